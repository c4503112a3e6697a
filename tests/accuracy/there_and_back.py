#!/usr/bin/env python3
"""A real scan, of which no truth is known, registered to the template and the template to it: how far off tissue is
that went there and came back, beside what both registrations state.

    tests/accuracy/there_and_back.py STUDY/study.json [--scan pose1] [--work WORK] [--kinevox build/bin/kinevox]

The study has a label map. Two models are built below WORK: of the template and the scan, and of both with the scan as
template, whose label map is the first model's bones, posed. Every other voxel along each axis of the first template
goes through both. Printed: how far from where it began it ends (mean, median, 95th percentile), the mean of what is
stated (of both as squares), and the shares within that (two of three are promised) and within twice that (nineteen of
twenty); of bone, of soft tissue by what both confidences are at least, and of soft tissue of 50 % and more by the
distance from the end of the scan's view. It is the least that tissue may be off: errors that both registrations have
in common do not show, and in phantoms they are more than half of it. Needs numpy, scipy and nibabel.
"""
import argparse
import json
import tempfile
from pathlib import Path

import nibabel
import numpy as np

from how_sure import registered, run, stated_at

EVERY = 2  # voxels
FROM_END_VOXELS = [0, 2, 4, 8, 12, 20, np.inf]


def absolute(study, folder):
    """The study with its files wherever it is written."""
    for scan in study["scans"]:
        scan["volume"] = str((folder / scan["volume"]).resolve())
    study["bones"]["labels"] = str((folder / study["bones"]["labels"]).resolve())
    return study


def build(program, study, model):
    model.parent.mkdir(parents=True, exist_ok=True)
    description = model.with_suffix(".json")
    description.write_text(json.dumps(study))
    run(program, "build", description, "--out", model, "--quiet")


def labels_on_scan(program, model, scan, volume, out):
    """The template's bones where the scan shows them, on its own grid."""
    posed_path = out.with_name("posed_labels.nii.gz")
    run(program, "pose", model, "--scan", scan, "--label", "--out", posed_path, "--quiet")
    posed, image = nibabel.load(posed_path), nibabel.load(volume)
    voxels = np.indices(image.shape).reshape(3, -1).T
    places = nibabel.affines.apply_affine(np.linalg.inv(posed.affine) @ image.affine, voxels)
    nearest = np.rint(places).astype(int)
    inside = ((nearest >= 0) & (nearest < posed.shape)).all(1)
    labels = np.zeros(len(voxels), posed.get_data_dtype())
    labels[inside] = np.asarray(posed.dataobj)[tuple(nearest[inside].T)]
    nibabel.save(nibabel.Nifti1Image(labels.reshape(image.shape), image.affine), out)


def both_ways(program, study, scan, work):
    there, back = work / "there", work / "back"
    pair = [s for s in study["scans"] if s["name"] in (study["template"], scan)]
    build(program, {**study, "scans": pair}, there)
    volume = next(s["volume"] for s in pair if s["name"] == scan)
    labels = work / "labels.nii.gz"
    labels_on_scan(program, there, scan, volume, labels)
    build(program, {**study, "scans": pair, "template": scan, "bones": {**study["bones"], "labels": str(labels)}}, back)
    return there, back, nibabel.load(volume)


def trip(program, study, scan, there, back, image):
    """Of every voxel that both registrations state an error of."""
    template = nibabel.load(study["bones"]["labels"])
    voxels = np.stack(np.meshgrid(*[np.arange(0, n, EVERY) for n in template.shape], indexing="ij"), -1).reshape(-1, 3)
    start = nibabel.affines.apply_affine(template.affine, voxels)
    with tempfile.TemporaryDirectory() as folder:
        scratch = Path(folder)
        first_mm, first_sure, _ = stated_at(program, there, scan, start, scratch)
        known = np.isfinite(first_mm)
        voxels, start, first_mm, first_sure = (values[known] for values in (voxels, start, first_mm, first_sure))
        middle = registered(program, there, scan, start, scratch)
        second_mm, second_sure, _ = stated_at(program, back, study["template"], middle, scratch)
        end = registered(program, back, study["template"], middle, scratch)
    place = nibabel.affines.apply_affine(np.linalg.inv(image.affine), middle)
    return {"off_mm": np.linalg.norm(end - start, axis=1), "stated_mm": np.hypot(first_mm, second_mm),
            "sure": np.minimum(first_sure, second_sure),
            "from_end": np.minimum(place, np.array(image.shape) - 1 - place).min(1),
            "bone": np.asarray(template.dataobj)[tuple(voxels.T)] > 0}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("study", type=Path)
    parser.add_argument("--scan", help="default: the first that is not the template")
    parser.add_argument("--work", type=Path)
    parser.add_argument("--kinevox", default="build/bin/kinevox")
    arguments = parser.parse_args()
    study = absolute(json.loads(arguments.study.read_text()), arguments.study.parent)
    scan = arguments.scan or next(s["name"] for s in study["scans"] if s["name"] != study["template"])
    with tempfile.TemporaryDirectory() as scratch:
        there, back, image = both_ways(arguments.kinevox, study, scan, (arguments.work or Path(scratch)).resolve())
        points = trip(arguments.kinevox, study, scan, there, back, image)
    soft, sure, from_end = ~points["bone"], points["sure"], points["from_end"]
    groups = {"bone": points["bone"], "soft tissue": soft, "at least 50 % sure": soft & (sure >= 50),
              "at least 75 % sure": soft & (sure >= 75)}
    for low, high in zip(FROM_END_VOXELS, FROM_END_VOXELS[1:]):
        wide = f"{low} to {high}" if np.isfinite(high) else f"{low} and more"
        groups[f"50 % sure, {wide} voxels from the view's end"] = \
            soft & (sure >= 50) & (from_end >= low) & (from_end < high)
    print("| where | points | off, mm: mean, median, 95 % | stated, mm | within | within twice |")
    print("| --- | --- | --- | --- | --- | --- |")
    for name, some in groups.items():
        some = some & np.isfinite(points["off_mm"] + points["stated_mm"])
        if not some.any():
            continue
        off, stated = points["off_mm"][some], points["stated_mm"][some]
        print(f"| {name} | {some.sum():,} | {off.mean():.2f}, {np.median(off):.2f}, {np.percentile(off, 95):.2f} | "
              f"{stated.mean():.2f} | {(off <= stated).mean():.2f} | {(off <= 2 * stated).mean():.2f} |")


if __name__ == "__main__":
    main()
