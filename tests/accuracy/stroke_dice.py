#!/usr/bin/env python3
"""How well bones come out of random strokes, by true labels.

    tests/accuracy/stroke_dice.py PHANTOM [PHANTOM ...] [--seed 1] [--background near|far] [--kinevox build/bin/kinevox]
    tests/accuracy/stroke_dice.py SCAN --labels LABELS --bones 32,33,98-103 [--each] ...

PHANTOM: a folder that `kinevox phantom` wrote. SCAN and LABELS: two NIfTI files on one grid, of which --bones are the
bones; all else is background, other labels too. In every bone 12 lines of 8 mm in random directions, ended at the
bone's border; 24 of 15 mm in the background: in tissue within 12 mm of a bone (near), or anywhere (far). Printed for
every scan: mean and least Dice of its bones with the true labels, and how many stay below 0.85; with --each then every
bone, by its Dice, the share of it that was missed and what was too much (as a share of it), and the warnings. Needs
numpy, scipy and nibabel.
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
AIR_HU = -1024


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
        greys = np.maximum(scan - AIR_HU, 0) if scan.min() < AIR_HU / 2 else scan
        background &= ndimage.gaussian_filter(greys, 1) > TISSUE * np.percentile(greys, 95)
        background &= ndimage.distance_transform_edt(labels == 0, sampling=spacing) < NEAR_MM
    for _ in range(24):
        draw(random, strokes, background, spacing, 15, BACKGROUND)
    return strokes


def shares_of(labels, found):
    """Of every bone its label, its Dice, the share missed and what is too much, as a share of it."""
    for bone in np.unique(labels)[1:]:
        true, seen = labels == bone, found == bone
        both = (true & seen).sum()
        yield bone, 2 * both / (true.sum() + seen.sum()), 1 - both / true.sum(), (seen.sum() - both) / true.sum()


def listed(text):
    ends = [[int(number) for number in part.split("-")] for part in text.split(",")]
    return [bone for part in ends for bone in range(part[0], part[-1] + 1)]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scans", nargs="+", type=Path, metavar="PHANTOM|SCAN")
    parser.add_argument("--labels", type=Path, help="true labels of SCAN")
    parser.add_argument("--bones", type=listed, help="which of the labels are bones; all, if left out")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--background", choices=["near", "far"], default="near")
    parser.add_argument("--kinevox", default="build/bin/kinevox")
    parser.add_argument("--each", action="store_true", help="print every bone, and the warnings")
    parser.add_argument("--keep", type=Path, help="a folder for the strokes and the bones of the last scan")
    args = parser.parse_args()
    for given in args.scans:
        image = nibabel.load(args.labels or given / "bones_template.nii.gz")
        file = given if args.labels else given / "pose00.nii.gz"
        labels, spacing = np.asarray(image.dataobj).astype(int), np.abs(image.header.get_zooms()[:3])
        if args.bones:
            labels[~np.isin(labels, args.bones)] = 0
        scan = nibabel.load(file).get_fdata()
        strokes = drawn(labels, scan, spacing, args.background == "near", np.random.default_rng(args.seed))
        with tempfile.TemporaryDirectory() as folder:
            work = args.keep or Path(folder)
            work.mkdir(parents=True, exist_ok=True)
            seeds, bones = work / "strokes.nii.gz", work / "bones.nii.gz"
            nibabel.save(nibabel.Nifti1Image(strokes, image.affine), seeds)
            run = subprocess.run([args.kinevox, "segment", str(file), "--seeds", str(seeds), "--out", str(bones),
                                  "--region", "custom", "--quiet"], check=True, capture_output=True, text=True)
            found = list(shares_of(labels, np.asarray(nibabel.load(bones).dataobj)))
        dice = [bone[1] for bone in found]
        print(f"{given.name}: {np.mean(dice):.3f}, {min(dice):.2f}; {sum(d < 0.85 for d in dice)} of {len(dice)} below")
        if args.each:
            for bone, value, missed, too_much in found:
                print(f"  {bone}: {value:.3f}, missed {missed:.2f}, too much {too_much:.2f}")
            print(run.stderr, end="")


if __name__ == "__main__":
    main()
