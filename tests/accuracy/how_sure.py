#!/usr/bin/env python3
"""How sure a registration says it is, beside how far off it is, at the truth points of a phantom.

    tests/accuracy/how_sure.py STUDY=MODEL [STUDY=MODEL ...] [--kinevox build/bin/kinevox]

STUDY: a folder that `kinevox phantom` wrote; MODEL: built of it by `kinevox build`. Soft-tissue points in the field of
view that no fold hides, every registered scan. Printed for every study: the share of points within the stated error
(two of three are promised) and within twice that (nineteen of twenty), of all, by distance from bone and of cartilage;
for every scan: the share of points whose place is right to half a voxel, the mean confidence, and the area under the
receiver operating characteristic, where the least confident are to be those that are not right (0.5: by chance); then,
over all, how many of the points of like confidence are right. Needs numpy, scipy and nibabel.
"""
import argparse
import json
import subprocess
import tempfile
from pathlib import Path

import nibabel
import numpy as np
from scipy import ndimage

LPS = np.array([-1.0, -1.0, 1.0])
LIMITS = [1, 20, 40, 60, 80, 90, 95, 99, 101]  # of the confidence, per cent
STEP_MM = 0.05  # errors are stated in such steps
FROM_BONE_MM = [0, 2.5, 5, 10, np.inf]  # of voxels' centres


def run(program, *words):
    return subprocess.run([program, *map(str, words)], check=True, capture_output=True, text=True).stdout


def registered(program, model, scan, points_ras, scratch):
    """Where the registration takes points of the template."""
    there, back = scratch / "points.csv", scratch / "mapped.csv"
    np.savetxt(there, points_ras * LPS, delimiter=",", header="x,y,z", comments="")
    run(program, "map-points", model, "--scan", scan, "--stage", "register", "--points", there, "--out", back,
        "--quiet")
    mapped = np.genfromtxt(back, delimiter=",", names=True)
    return np.stack([mapped[a] for a in "xyz"], -1) * LPS


def at_points(image, points_ras):
    voxels = np.rint(nibabel.affines.apply_affine(np.linalg.inv(image.affine), points_ras)).astype(int)
    voxels = np.clip(voxels, 0, np.array(image.shape) - 1)
    return np.asarray(image.dataobj)[tuple(voxels.T)].astype(float)


def stated_at(program, model, scan, points_ras, scratch):
    """The error in mm, the confidence in per cent, and half a voxel in mm."""
    values = []
    for field in ["--error", "--confidence"]:
        path = scratch / "field.nii.gz"
        run(program, "field", model, "--scan", scan, field, "--out", path, "--quiet")
        image = nibabel.load(path)
        values.append(at_points(image, points_ras))
    return *values, 0.5 * abs(np.linalg.det(image.affine[:3, :3])) ** (1 / 3)


def distance_from_bone(study):
    labels = nibabel.load(study / "bones_template.nii.gz")
    soft = np.asarray(labels.dataobj) == 0
    spacing_mm = np.linalg.norm(labels.affine[:3, :3], axis=0)
    distance_mm = ndimage.distance_transform_edt(soft, sampling=spacing_mm)
    return nibabel.Nifti1Image(distance_mm.astype(np.float32), labels.affine)


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
    from_bone_mm = distance_from_bone(study)
    for scan in [s["name"] for s in json.loads(run(program, "info", model, "--json"))["scans"]]:
        truth_file = study / "truth" / f"{scan}_points.npz"
        if not truth_file.exists():
            continue
        truth = np.load(truth_file)
        mapped = registered(program, model, scan, truth["template"], scratch)
        stated_mm, confidence, half_voxel = stated_at(program, model, scan, truth["template"], scratch)
        off_mm = np.linalg.norm(mapped - truth["position"], axis=1)
        shown = truth["in_fov"].astype(bool) & ~truth["hidden"].astype(bool)
        counts = shown & (truth["bone"] <= 0) & np.isfinite(off_mm)
        points = {"off_mm": off_mm, "stated_mm": stated_mm, "confidence": confidence, "right": off_mm < half_voxel,
                  "from_bone_mm": at_points(from_bone_mm, truth["template"]),
                  "cartilage": truth["tissue_names"][truth["tissue"]] == "cartilage"}
        yield scan, {name: values[counts] for name, values in points.items()}


def joined(scans):
    return {name: np.concatenate([points[name] for points in scans]) for name in scans[0]}


def print_stated(name, points):
    distance = points["from_bone_mm"]
    groups = {"all": distance >= 0, "in voxels of bone": distance == 0}
    for low, high in zip(FROM_BONE_MM, FROM_BONE_MM[1:]):
        groups[f"to {high} mm from bone" if np.isfinite(high) else "farther"] = (distance > low) & (distance <= high)
    groups["cartilage"] = points["cartilage"]
    for group, some in groups.items():
        some = some & np.isfinite(points["stated_mm"])
        if not some.any():
            continue
        off, stated = points["off_mm"][some], np.maximum(points["stated_mm"][some], STEP_MM)
        print(f"| {name} | {group} | {some.sum():,} | {np.median(stated):.2f} | {np.median(off):.2f} | "
              f"{(off <= stated).mean():.2f} | {(off <= 2 * stated).mean():.2f} |")


def print_confidence(studies):
    print("\n| scan | right to half a voxel | mean confidence | area |\n| --- | --- | --- | --- |")
    for study, scans in studies:
        for scan, points in scans.items():
            confidence, right = points["confidence"], points["right"]
            print(f"| {study} {scan} | {right.mean():.3f} | {confidence.mean() / 100:.3f} | "
                  f"{area_under(confidence, right):.2f} |")
    every = joined([points for _, scans in studies for points in scans.values()])
    confidence, right = every["confidence"], every["right"]
    print("\n| confidence, per cent | share of points | mean | right to half a voxel |\n| --- | --- | --- | --- |")
    for low, high in zip([0] + LIMITS[:-1], LIMITS):
        some = (confidence >= low) & (confidence < high)
        if some.any():
            named = "0" if high == 1 else f"{low} to {high - 1}"
            print(f"| {named} | {some.mean():.3f} | {confidence[some].mean() / 100:.3f} | {right[some].mean():.3f} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pairs", nargs="+", metavar="STUDY=MODEL")
    parser.add_argument("--kinevox", default="build/bin/kinevox")
    arguments = parser.parse_args()
    studies = []
    print("| study | where | points | median stated, mm | median error, mm | within | within twice |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    with tempfile.TemporaryDirectory() as scratch:
        for pair in arguments.pairs:
            study, model = map(Path, pair.rsplit("=", 1))
            scans = dict(points_of(arguments.kinevox, study, model, Path(scratch)))
            studies.append((study.name, scans))
            print_stated(study.name, joined(list(scans.values())))
    print_confidence(studies)


if __name__ == "__main__":
    main()
