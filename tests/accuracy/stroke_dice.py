#!/usr/bin/env python3
"""How well bones come out of random strokes, by the labels of a phantom.

    tests/accuracy/stroke_dice.py PHANTOM [PHANTOM ...] [--seed 1] [--background near|far] [--kinevox build/bin/kinevox]

PHANTOM: a folder that `kinevox phantom` wrote. In every bone 12 lines of 8 mm in random directions, ended at the
bone's border; 24 of 15 mm in the background: in tissue within 12 mm of a bone (near), or anywhere (far). Printed for
every phantom: mean and least Dice of its bones with the true labels, and how many stay below 0.85. Needs numpy, scipy
and nibabel.
"""
import argparse
import subprocess
import tempfile
from pathlib import Path

import nibabel
import numpy as np
from scipy import ndimage

BACKGROUND = 255
NEAR_MM = 12
TISSUE = 0.15  # of a bright voxel: more is tissue
STEP_MM = 0.5


def draw(random, strokes, where, spacing, length_mm, value):
    """One line from a random voxel of `where`, ended where it leaves it."""
    voxels = np.argwhere(where)
    start = voxels[random.integers(len(voxels))]
    along = random.normal(size=3)
    along /= np.linalg.norm(along)
    for way in np.arange(0, length_mm, STEP_MM):
        at = np.round(start + along * way / spacing).astype(int)
        if (at < 0).any() or (at >= where.shape).any() or not where[tuple(at)]:
            return
        strokes[tuple(at)] = value


def drawn(labels, scan, spacing, near, random):
    strokes = np.zeros(labels.shape, np.uint8)
    for bone in np.unique(labels)[1:]:
        for _ in range(12):
            draw(random, strokes, labels == bone, spacing, 8, bone)
    background = labels == 0
    if near:
        background &= ndimage.gaussian_filter(scan, 1) > TISSUE * np.percentile(scan, 95)
        background &= ndimage.distance_transform_edt(labels == 0, sampling=spacing) < NEAR_MM
    for _ in range(24):
        draw(random, strokes, background, spacing, 15, BACKGROUND)
    return strokes


def dice_of(labels, found):
    for bone in np.unique(labels)[1:]:
        true, seen = labels == bone, found == bone
        yield 2 * (true & seen).sum() / (true.sum() + seen.sum())


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("phantoms", nargs="+", type=Path)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--background", choices=["near", "far"], default="near")
    parser.add_argument("--kinevox", default="build/bin/kinevox")
    args = parser.parse_args()
    for phantom in args.phantoms:
        image = nibabel.load(phantom / "bones_template.nii.gz")
        labels, spacing = np.asarray(image.dataobj).astype(int), np.abs(image.header.get_zooms()[:3])
        scan = nibabel.load(phantom / "pose00.nii.gz").get_fdata()
        strokes = drawn(labels, scan, spacing, args.background == "near", np.random.default_rng(args.seed))
        with tempfile.TemporaryDirectory() as folder:
            seeds, bones = Path(folder, "strokes.nii.gz"), Path(folder, "bones.nii.gz")
            nibabel.save(nibabel.Nifti1Image(strokes, image.affine), seeds)
            subprocess.run([args.kinevox, "segment", str(phantom / "pose00.nii.gz"), "--seeds", str(seeds), "--out",
                            str(bones), "--region", "custom", "--quiet"], check=True, capture_output=True)
            dice = list(dice_of(labels, np.asarray(nibabel.load(bones).dataobj)))
        print(f"{phantom.name}: {np.mean(dice):.3f}, {min(dice):.2f}; {sum(d < 0.85 for d in dice)} of {len(dice)} below")


if __name__ == "__main__":
    main()
