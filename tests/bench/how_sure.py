#!/usr/bin/env python3
"""How sure a registration says it is, beside how far off it is, at the truth points of a phantom.

    tests/bench/how_sure.py STUDY=MODEL [STUDY=MODEL ...] [--kinevox build/bin/kinevox]

STUDY: a folder that `kinevox phantom` wrote; MODEL: built of it by `kinevox build`. Soft-tissue points that no fold
hides, every registered scan. Printed for every scan: the share of points whose place is right to half a voxel, the
mean confidence, and the area under the receiver operating characteristic, where the least confident are to be those
that are not right (0.5: by chance); then, over all, how many of the points of like confidence are right. Needs numpy
and nibabel.
"""
import argparse
import json
import subprocess
import tempfile
from pathlib import Path

import nibabel
import numpy as np

LPS = np.array([-1.0, -1.0, 1.0])
LIMITS = [1, 20, 40, 60, 80, 90, 95, 99, 101]  # of the confidence, per cent


def run(program, *words):
    return subprocess.run([program, *map(str, words)], check=True, capture_output=True, text=True).stdout


def registered(program, model, scan, points_ras, scratch):
    """Where the registration takes points of the template."""
    there, back = scratch / "points.csv", scratch / "mapped.csv"
    np.savetxt(there, points_ras * LPS, delimiter=",", header="x,y,z", comments="")
    run(program, "map-points", model, "--scan", scan, "--stage", "register", "--points", there, "--out", back, "--quiet")
    mapped = np.genfromtxt(back, delimiter=",", names=True)
    return np.stack([mapped[a] for a in "xyz"], -1) * LPS


def confidence_at(program, model, scan, points_ras, scratch):
    """Per cent, and half a voxel in mm."""
    path = scratch / "confidence.nii.gz"
    run(program, "field", model, "--scan", scan, "--confidence", "--out", path, "--quiet")
    image = nibabel.load(path)
    voxels = np.rint(nibabel.affines.apply_affine(np.linalg.inv(image.affine), points_ras)).astype(int)
    voxels = np.clip(voxels, 0, np.array(image.shape) - 1)
    half_voxel = 0.5 * abs(np.linalg.det(image.affine[:3, :3])) ** (1 / 3)
    return np.asarray(image.dataobj)[tuple(voxels.T)].astype(float), half_voxel


def area_under(confidence, right):
    """That a right point has more of it than a wrong one; ties count half."""
    if right.all() or not right.any():
        return float("nan")
    order, ranks = np.unique(confidence, return_inverse=True)
    counts = np.bincount(ranks, minlength=len(order))
    mean_rank = np.cumsum(counts) - (counts - 1) / 2
    of_right = mean_rank[ranks][right]
    return (of_right.sum() - len(of_right) * (len(of_right) + 1) / 2) / (len(of_right) * (~right).sum())


def points_of(program, study, model, scratch):
    for scan in [s["name"] for s in json.loads(run(program, "info", model, "--json"))["scans"]]:
        truth_file = study / "truth" / f"{scan}_points.npz"
        if not truth_file.exists():
            continue
        truth = np.load(truth_file)
        mapped = registered(program, model, scan, truth["template"], scratch)
        confidence, half_voxel = confidence_at(program, model, scan, truth["template"], scratch)
        off = np.linalg.norm(mapped - truth["position"], axis=1)
        counts = ~truth["hidden"].astype(bool) & (truth["bone"] <= 0) & np.isfinite(off)
        yield f"{study.name} {scan}", confidence[counts], off[counts] < half_voxel


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pairs", nargs="+", metavar="STUDY=MODEL")
    parser.add_argument("--kinevox", default="build/bin/kinevox")
    arguments = parser.parse_args()
    every_confidence, every_right = [], []
    print("| scan | right to half a voxel | mean confidence | area |\n| --- | --- | --- | --- |")
    with tempfile.TemporaryDirectory() as scratch:
        for pair in arguments.pairs:
            study, model = map(Path, pair.rsplit("=", 1))
            for name, confidence, right in points_of(arguments.kinevox, study, model, Path(scratch)):
                print(f"| {name} | {right.mean():.3f} | {confidence.mean() / 100:.3f} | {area_under(confidence, right):.2f} |")
                every_confidence.append(confidence), every_right.append(right)
    confidence, right = np.concatenate(every_confidence), np.concatenate(every_right)
    print("\n| confidence, per cent | share of points | mean | right to half a voxel |\n| --- | --- | --- | --- |")
    for low, high in zip([0] + LIMITS[:-1], LIMITS):
        some = (confidence >= low) & (confidence < high)
        if some.any():
            named = "0" if high == 1 else f"{low} to {high - 1}"
            print(f"| {named} | {some.mean():.3f} | {confidence[some].mean() / 100:.3f} | {right[some].mean():.3f} |")


if __name__ == "__main__":
    main()
