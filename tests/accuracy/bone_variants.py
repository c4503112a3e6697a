#!/usr/bin/env python3
"""How the bones of a phantom's scans are found when the scans are worse: blurred, noisy, cropped, halved, turned, of another
scale, shaded, of another contrast.

    tests/accuracy/bone_variants.py --kinevox build/bin/kinevox --dataset PHANTOM --work WORK [--only blurred,cropped] [--write-only]

Each variant is a data set of its own below WORK, with the true poses that belong to it; its model is built there. Printed
per variant, for bones of 300 voxels and more: how many miss 1.5 degrees or half a voxel, how many are named as doubtful or
uncertain, and how many misses are called sure. Needs numpy, scipy and nibabel.
"""
import argparse
import json
import subprocess
from pathlib import Path

import nibabel
import numpy as np
from scipy import ndimage
from scipy.spatial.transform import Rotation

from bone_accuracy import bone_rows, counts_of


def rician(values, sigma, random):
    return np.hypot(values + sigma * random.standard_normal(values.shape), sigma * random.standard_normal(values.shape))


def blurred(values, affine, truth, random):
    """Two voxels full width at half maximum."""
    return ndimage.gaussian_filter(values, 2 / 2.355), affine, truth


def noisy(values, affine, truth, random):
    """Noise of an eighth of the bright tissue's level, on top of the phantom's own."""
    return rician(values, np.percentile(values[values > values.mean()], 75) / 8, random), affine, truth


def cropped(values, affine, truth, random):
    """What lies beyond the centre of the bone that is farthest from the root is outside the view."""
    centres = np.array([pose[:3, :3] @ centroid + pose[:3, 3] for pose, centroid in truth])
    at = np.c_[centres, np.ones(len(centres))] @ np.linalg.inv(affine).T
    spacing = np.linalg.norm(affine[:3, :3], axis=0)
    away = (at[:, :3] - at[0, :3]) * spacing
    tip, axis = np.unravel_index(np.abs(away).argmax(), away.shape)
    end = int(np.clip(round(at[tip, axis]), 1, values.shape[axis] - 2))
    window = [slice(None)] * 3
    window[axis] = slice(0, end) if away[tip, axis] > 0 else slice(end, None)
    shift = np.zeros(4)
    shift[axis] = window[axis].start or 0
    affine = affine.copy()
    affine[:, 3] += affine @ shift
    return values[tuple(window)], affine, truth


def turned(values, affine, truth, random):
    """The whole limb turned by 60 degrees about an oblique axis: the voxels are the same, their frame is not."""
    turn = np.eye(4)
    turn[:3, :3] = Rotation.from_rotvec(np.radians(60) * np.array([1, 2, 2]) / 3).as_matrix()
    return values, turn @ affine, [(turn @ pose, centroid) for pose, centroid in truth]


def scaled(values, affine, truth, random):
    return 3.7 * values + 100, affine, truth


def shaded(values, affine, truth, random):
    """A coil's field across the view, 40 % up and down, bent along the other axes."""
    i, j, k = np.meshgrid(*(np.linspace(-1, 1, n) for n in values.shape), indexing="ij", sparse=True)
    return values * (1 + 0.4 * np.clip(0.8 * j + 0.4 * np.sin(3 * i) * k, -1, 1)), affine, truth


def half_of(values, affine, keep_first):
    axis = int(np.argmax(np.array(values.shape) * np.linalg.norm(affine[:3, :3], axis=0)))
    middle = values.shape[axis] // 2
    window = [slice(None)] * 3
    window[axis] = slice(0, middle) if keep_first else slice(middle, None)
    affine = affine.copy()
    if not keep_first:
        affine[:3, 3] += middle * affine[:3, axis]
    return values[tuple(window)], affine


def first_half(values, affine, truth, random):
    """Half of the view missing, along its longest axis."""
    return *half_of(values, affine, True), truth


def second_half(values, affine, truth, random):
    return *half_of(values, affine, False), truth


def share_of_bright(values):
    return np.clip(values / np.percentile(values, 99.5), 0, 1)


def curved(values, affine, truth, random):
    """Another curve of greys, still rising: darker tissues brighter."""
    return 200 * share_of_bright(values) ** 0.5, affine, truth


def inverted(values, affine, truth, random):
    """Bright becomes dark inside the body; air stays air."""
    top = np.percentile(values, 99.5)
    return np.where(values > 0.15 * top, np.clip(1.2 * top - values, 0.2 * top, None), values), affine, truth


def other_contrast(values, affine, truth, random):
    """A curve that rises and falls: middle grey is brightest."""
    x = share_of_bright(values)
    return 255 * (0.15 * x + 3.2 * x * (1 - x)), affine, truth


VARIANTS = {"as it is": lambda *scan: scan[:3], "blurred": blurred, "noisy": noisy, "cropped": cropped,
            "first half": first_half, "second half": second_half, "turned": turned, "scaled": scaled, "shaded": shaded,
            "curved": curved, "inverted": inverted, "other contrast": other_contrast}


def write_variant(change, dataset, folder):
    folder.mkdir(parents=True, exist_ok=True)
    study = json.loads((dataset / "study.json").read_text())
    manifest = json.loads((dataset / "manifest.json").read_text())
    centroids = [np.array(bone["centroid"]) for bone in manifest["bones"]]
    random = np.random.default_rng(7)
    for scan in study["scans"]:
        source, name = dataset / scan["volume"], f"{scan['name']}.nii.gz"
        scan["volume"] = str(source.resolve())
        if scan["name"] == study["template"]:
            continue
        pose = next(p for p in manifest["poses"] if p["file"].split(".")[0] == scan["name"])
        image = nibabel.load(source)
        truth = [(np.array(T, float).reshape(4, 4), centroid) for T, centroid in zip(pose["T"], centroids)]
        values, affine, truth = change(image.get_fdata(), image.affine, truth, random)
        pose["T"] = [T.tolist() for T, _ in truth]
        nibabel.save(nibabel.Nifti1Image(values.astype(np.float32), affine), folder / name)
        scan["volume"] = name
    study["bones"]["labels"] = str((dataset / study["bones"]["labels"]).resolve())
    (folder / "study.json").write_text(json.dumps(study))
    (folder / "manifest.json").write_text(json.dumps(manifest))


def build(kinevox, folder):
    subprocess.run([kinevox, "build", folder / "study.json", "--out", folder / "model"], check=True, capture_output=True)
    told = subprocess.run([kinevox, "info", folder / "model", "--json"], check=True, capture_output=True).stdout
    return json.loads(told)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kinevox", default="build/bin/kinevox")
    parser.add_argument("--dataset", type=Path, required=True)
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--only", default=",".join(VARIANTS))
    parser.add_argument("--write-only", action="store_true", help="make the data sets, build nothing")
    arguments = parser.parse_args()
    for name in arguments.only.split(","):
        folder = arguments.work / name.replace(" ", "-")
        write_variant(VARIANTS[name], arguments.dataset, folder)
        if arguments.write_only:
            continue
        info = build(arguments.kinevox, folder)
        manifest = json.loads((folder / "manifest.json").read_text())
        counts = counts_of(bone_rows(info, manifest), info)
        print(f"| {name} | {counts['misses']} of {counts['bones']} | {counts['named']} | {counts['silent']} |", flush=True)


if __name__ == "__main__":
    main()
