#!/usr/bin/env python3
"""How well a threshold finds real bones in CT: hollow shafts, marrow, spongy ends.

    tests/accuracy/real_ct_bones.py --shared ../shared [--kinevox build/bin/kinevox] [--threshold auto] [--work WORK]

The bones of a wrist of which `wrist-bone-ct-crops` has the real CT (radius, ulna, metacarpals 2 and 3), laid into
soft tissue of 40 HU within fat and air, by themselves and as a wrist (radius and ulna side by side, 0.8 mm or 1.6 mm
apart, metacarpals as far from the radius), blurred by half a voxel, with noise, on voxels as scanned
(0.4 x 0.4 x 0.625 mm), twice and three times as wide; the wrist also on a table and in a cast with 3 mm of padding. Printed for each: the Dice of every bone with the label most
like it, and how many labels were found. A bone is all that its crop shows, marrow included. Needs numpy, scipy and
nibabel.
"""
import argparse
import subprocess
import tempfile
from pathlib import Path

import nibabel
import numpy as np
from scipy import ndimage

AIR_HU, FAT_HU, SOFT_HU, TABLE_HU, CAST_HU = -1000, -100, 40, 1000, 1000
STORED_ABOVE_HU = 1024
MARGIN = 16
WRIST = (200, 230, 274)  # voxels


def crop(shared, name, flipped):
    """Greys in HU, and 1 where the bone is; shafts are to be cut by the view, so some are turned over."""
    file = nibabel.load(shared / "data/wrist-bone-ct-crops" / f"{name}.nii.gz")
    stored = np.asarray(file.dataobj).astype(np.int32)
    if flipped:
        stored = stored[:, :, ::-1]
    return stored - STORED_ABOVE_HU, (stored > 0).astype(np.uint16), np.abs(np.diag(file.affine)[:3])


def parted(mask, spacing):
    """Two bones that one crop shows: from what stays apart 0.8 mm below their surface, one voxel at a time."""
    depth = ndimage.distance_transform_edt(mask, sampling=spacing)
    cores, _ = ndimage.label(depth > 0.8)
    largest = np.argsort(np.bincount(cores.ravel())[1:])[::-1][:2] + 1
    labels = np.zeros(mask.shape, np.uint16)
    for number, core in enumerate(largest, 1):
        labels[cores == core] = number
    while (open_voxels := mask & (labels == 0)).any():
        grown = ndimage.grey_dilation(labels, footprint=ndimage.generate_binary_structure(3, 1))
        if not (grown[open_voxels] > 0).any():
            break
        labels[open_voxels] = grown[open_voxels]
    return labels


def window(at, labels):
    return tuple(slice(a, a + n) for a, n in zip(at, labels.shape))


def pushed(placed, shape, labels, at, step, apart):
    """As far along `step` as the bone stays this many voxels apart from those that are placed."""
    taken = np.zeros(shape, bool)
    for _, other, there in placed:
        taken[window(there, other)] |= other > 0
    taken = ndimage.binary_dilation(taken, iterations=apart)
    at = np.array(at)
    while True:
        beside = at + step
        if (beside < 0).any() or (beside + labels.shape > shape).any():
            return at
        if (taken[window(beside, labels)] & (labels > 0)).any():
            return at
        at = beside


def on_a_table(greys, limb, spacing):
    """Two sheets of 2.5 mm, 15 mm apart, below the limb."""
    below = limb.any((0, 2)).argmax()
    for top_mm in (0, 15):
        top = below - round(top_mm / spacing[1])
        sheet = slice(max(top - round(2.5 / spacing[1]), 0), max(top, 0))
        greys[:, sheet][~limb[:, sheet]] = TABLE_HU


def in_a_cast(greys, limb, spacing):
    outside_mm = ndimage.distance_transform_edt(~limb, sampling=spacing)
    greys[(outside_mm > 3) & (outside_mm < 7)] = CAST_HU


def scene(placed, shape, noise_hu, seed, spacing=None, add=None):
    greys, labels = np.full(shape, float(SOFT_HU)), np.zeros(shape, np.uint16)
    for hu, bone, at in placed:
        here = window(at, bone)
        inside = (bone > 0) & (labels[here] == 0)
        greys[here][inside] = hu[inside]
        labels[here][inside] = bone[inside] + labels.max()
    x, y = np.meshgrid(*(np.linspace(-1, 1, n) for n in shape[:2]), indexing="ij")
    limb = (x**2 + y**2 <= 1)[:, :, None] | ndimage.binary_dilation(labels > 0, iterations=5)
    fat = limb & ~ndimage.binary_erosion(limb, iterations=6, border_value=1)
    greys[fat & ~ndimage.binary_dilation(labels > 0, iterations=2)] = FAT_HU
    greys[~limb] = AIR_HU
    if add:
        room = ((50, 50), (50, 50), (0, 0))
        greys, labels, limb = np.pad(greys, room, constant_values=AIR_HU), np.pad(labels, room), np.pad(limb, room)
        add(greys, limb, spacing)
    greys = ndimage.gaussian_filter(greys, 0.5)
    return greys + np.random.default_rng(seed).normal(0, noise_hu, greys.shape), labels


def coarser(greys, labels, factor):
    whole = [n // factor * factor for n in greys.shape]
    greys, labels = (a[: whole[0], : whole[1], : whole[2]] for a in (greys, labels))
    blocks = greys.reshape([n for size in whole for n in (size // factor, factor)]).mean((1, 3, 5))
    middle = factor // 2
    return blocks, labels[middle::factor, middle::factor, middle::factor]


def wrist(bones, apart):
    placed = [(*bones["rad"], (60, 70, 0))]
    for name, at, step in (("uln", (65, 185, 0), (0, -1, 0)), ("mc2_mc3", (62, 60, 150), (0, 0, -1))):
        labels = bones[name][1]
        placed.append((*bones[name], pushed(placed, WRIST, labels, at, np.array(step), apart)))
    return placed


def scenes(shared):
    bones = {name: crop(shared, name, flipped=name in ("rad", "uln")) for name in ("rad", "uln", "mc3", "mc2_mc3")}
    spacing = bones["rad"][2]
    bones = {name: (hu, mask) for name, (hu, mask, _) in bones.items()}
    bones["mc2_mc3"] = (bones["mc2_mc3"][0], parted(bones["mc2_mc3"][1] > 0, spacing))
    for name, (hu, labels) in bones.items():
        shape = tuple(np.array(labels.shape) + (2 * MARGIN, 2 * MARGIN, 8))
        yield name, *scene([(hu, labels, (MARGIN, MARGIN, 0))], shape, 15, 0), spacing
    for name in ("rad", "mc2_mc3"):
        hu, labels = bones[name]
        shape = tuple(np.array(labels.shape) + (2 * MARGIN, 2 * MARGIN, 8))
        yield f"{name}, noise 80 HU", *scene([(hu, labels, (MARGIN, MARGIN, 0))], shape, 80, 9), spacing
    for apart in (2, 4):
        yield f"wrist, {apart} voxels apart", *scene(wrist(bones, apart), WRIST, 25, apart), spacing
    for add in (on_a_table, in_a_cast):
        yield f"wrist, {add.__name__.replace('_', ' ')}", *scene(wrist(bones, 4), WRIST, 25, 4, spacing, add), spacing


def dice(truth, found):
    count = int(found.max()) + 1
    both = np.bincount(truth.ravel().astype(int) * count + found.ravel(), minlength=count * (int(truth.max()) + 1))
    both = both.reshape(-1, count)
    for bone in range(1, both.shape[0]):
        yield max((2 * both[bone, 1:] / (both[bone].sum() + both.sum(0)[1:])), default=0)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--shared", type=Path, required=True)
    parser.add_argument("--kinevox", default="build/bin/kinevox")
    parser.add_argument("--threshold", default="auto", help="a level in HU, or auto")
    parser.add_argument("--work", type=Path, help="keep the scenes and what was found here")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        work = arguments.work or Path(scratch)
        work.mkdir(parents=True, exist_ok=True)
        for name, greys, labels, spacing in scenes(arguments.shared):
            for factor in (1, 2, 3):
                blocks, truth = coarser(greys, labels, factor)
                stem = f"{name.replace(', ', '-').replace(' ', '-')}-{factor}"
                scan, out = work / f"{stem}.nii.gz", work / f"{stem}.found.nii.gz"
                nibabel.save(nibabel.Nifti1Image(blocks.astype(np.int16), np.diag([*spacing * factor, 1])), scan)
                command = [arguments.kinevox, "segment", scan, "--threshold", arguments.threshold, "--out", out]
                run = subprocess.run([*command, "--quiet"], capture_output=True, text=True)
                if run.returncode:
                    print(f"{name}, voxels x {factor}: {run.stderr.strip()}", flush=True)
                    continue
                found = np.asarray(nibabel.load(out).dataobj).astype(int)
                values = " ".join(f"{value:.3f}" for value in dice(truth, found))
                warned = "; warned" if "warning" in run.stderr else ""
                print(f"{name}, voxels x {factor}: {values}; {found.max()} labels{warned}", flush=True)


if __name__ == "__main__":
    main()
