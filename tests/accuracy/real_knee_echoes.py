#!/usr/bin/env python3
"""How far tissue strays where a real knee has not moved: the echoes of one measurement, in which muscle goes dark.

    tests/accuracy/real_knee_echoes.py --shared ../shared [--kinevox build/bin/kinevox] [--work WORK]

`knee-mese-dicom` is a spin echo series of a knee, 0.625 x 0.625 mm in slices of 4 mm, of which three echoes are there.
Bones are found in the first from the strokes below, drawn by hand; the second and the eighth are the study's scans, as
they are and moved by 11 degrees and 12 mm (in the header alone, so no voxel is interpolated). Where everything lies in
them is known. Printed for each scan and stage: how far off soft tissue and bones are, in mm. Needs numpy, nibabel and
pydicom.
"""
import argparse
import json
import subprocess
import tempfile
from pathlib import Path

import nibabel
import numpy as np
import pydicom

BONES = {1: ("femur", None), 2: ("tibia", "femur"), 3: ("patella", "femur"), 4: ("fibula", "tibia")}
# Lines by label: slice, counted along the slices' normal, and column and row of both ends.
STROKES = {
    1: [(1, 128, 96, 136, 110), (2, 120, 90, 150, 110), (4, 110, 100, 160, 120), (6, 100, 90, 150, 120),
        (6, 125, 66, 120, 80), (8, 110, 50, 120, 90), (8, 90, 100, 130, 110), (11, 115, 10, 115, 80),
        (11, 95, 95, 100, 115), (14, 120, 10, 118, 70), (14, 90, 100, 150, 100), (17, 120, 15, 115, 70),
        (17, 90, 100, 155, 120), (19, 95, 90, 140, 120), (21, 130, 105, 140, 110)],
    2: [(2, 130, 158, 145, 160), (4, 115, 160, 150, 165), (6, 105, 160, 160, 165), (6, 135, 180, 130, 210),
        (8, 105, 160, 170, 160), (8, 130, 180, 130, 230), (11, 105, 165, 160, 165), (11, 130, 190, 125, 240),
        (14, 100, 180, 160, 170), (14, 125, 200, 128, 240), (17, 105, 170, 150, 175), (19, 115, 165, 160, 170),
        (21, 120, 168, 140, 172)],
    3: [(8, 42, 80, 48, 98), (10, 50, 80, 55, 108), (11, 50, 80, 55, 110), (11, 45, 72, 62, 66), (12, 50, 80, 55, 110),
        (14, 52, 75, 58, 110), (17, 55, 88, 57, 97)],
    4: [(19, 175, 190, 180, 230), (20, 170, 200, 180, 195), (21, 165, 200, 185, 190), (21, 175, 200, 176, 215),
        (22, 170, 198, 178, 198), (23, 165, 195, 175, 200)],
    255: [(0, 130, 30, 115, 45), (1, 120, 140, 140, 150), (2, 180, 220, 190, 200), (4, 100, 40, 140, 30),
          (4, 170, 200, 190, 240), (6, 95, 30, 130, 40), (6, 110, 149, 150, 149), (8, 80, 130, 92, 150),
          (8, 130, 143, 150, 142), (11, 90, 140, 110, 145), (11, 85, 45, 80, 60), (11, 170, 100, 190, 140),
          (11, 140, 112, 150, 105), (11, 50, 20, 40, 70), (14, 195, 45, 205, 60), (14, 75, 40, 80, 60),
          (14, 52, 132, 76, 160), (17, 212, 100, 222, 180), (17, 190, 150, 200, 200), (17, 120, 150, 160, 148),
          (17, 30, 100, 60, 140), (19, 190, 120, 200, 150), (19, 130, 148, 150, 149), (19, 120, 215, 140, 230),
          (21, 130, 130, 145, 140), (21, 180, 60, 170, 100), (21, 125, 215, 150, 230), (23, 160, 30, 150, 100)]}
LPS_FROM_RAS = np.diag([-1.0, -1.0, 1.0, 1.0])
TISSUE = 0.1  # of the brightest: more is tissue
POINTS = 6000


def echoes(folder):
    """By number: greys over column, row and slice, and LPS mm of those."""
    by_echo = {}
    for file in sorted(folder.iterdir()):
        image = pydicom.dcmread(file)
        by_echo.setdefault(int(image.EchoNumbers), []).append(image)
    for number, images in by_echo.items():
        across, down = np.array(images[0].ImageOrientationPatient, float).reshape(2, 3)
        normal = np.cross(across, down)
        images.sort(key=lambda image: np.dot(normal, np.array(image.ImagePositionPatient, float)))
        places = [np.array(image.ImagePositionPatient, float) for image in images]
        down_mm, across_mm = (float(mm) for mm in images[0].PixelSpacing)
        lps = np.eye(4)
        lps[:3, 0], lps[:3, 1] = across * across_mm, down * down_mm
        lps[:3, 2], lps[:3, 3] = (places[-1] - places[0]) / (len(places) - 1), places[0]
        by_echo[number] = np.stack([image.pixel_array.T for image in images], axis=2).astype(np.float32), lps
    return by_echo


def moved():
    """LPS mm from LPS mm."""
    turn = np.radians(11)
    out = np.eye(4)
    out[:3, :3] = [[1, 0, 0], [0, np.cos(turn), -np.sin(turn)], [0, np.sin(turn), np.cos(turn)]]
    out[:3, 3] = 8, -8, 4
    return out


def save(path, values, lps):
    nibabel.save(nibabel.Nifti1Image(values, LPS_FROM_RAS @ lps), path)


def strokes_on(shape):
    marks = np.zeros(shape, np.uint8)
    for label, lines in STROKES.items():
        for k, x0, y0, x1, y1 in lines:
            for share in np.linspace(0, 1, max(abs(x1 - x0), abs(y1 - y0)) + 1):
                marks[round(x0 + share * (x1 - x0)), round(y0 + share * (y1 - y0)), k] = label
    return marks


def prepare(shared, work):
    """The study in `work`; returns the first echo and, by scan, LPS mm in it from LPS mm in the first."""
    series = echoes(shared / "data/knee-mese-dicom/dicom")
    first, lps = series[1]
    save(work / "echo1.nii.gz", first, lps)
    save(work / "strokes.nii.gz", strokes_on(first.shape), lps)
    truth = {}
    for number in (2, 8):
        for name, place in ((f"echo{number}", np.eye(4)), (f"echo{number}moved", moved())):
            save(work / f"{name}.nii.gz", series[number][0], place @ lps)
            truth[name] = place
    listed = [{"label": label, "name": name, "parent": parent} for label, (name, parent) in BONES.items()]
    study = {"name": "echoes", "region": "knee", "template": "echo1",
             "scans": [{"name": name, "volume": f"{name}.nii.gz"} for name in ["echo1", *truth]],
             "bones": {"labels": "bones.nii.gz", "list": listed}}
    (work / "study.json").write_text(json.dumps(study))
    return (first, lps), truth


def report(run, work, first, lps, truth):
    labels = np.asarray(nibabel.load(work / "bones.nii.gz").dataobj)
    voxels = np.argwhere(first > TISSUE * np.percentile(first, 99.5))
    voxels = voxels[np.random.default_rng(0).choice(len(voxels), POINTS, replace=False)]
    points = voxels @ lps[:3, :3].T + lps[:3, 3]
    soft = labels[tuple(voxels.T)] == 0
    np.savetxt(work / "points.csv", points, delimiter=",", header="x,y,z", comments="", fmt="%.4f")
    for name, place in truth.items():
        for stage in ("initialise", "register"):
            run("map-points", work / "model", "--scan", name, "--stage", stage, "--points", work / "points.csv",
                "--out", work / "mapped.csv")
            mapped = np.genfromtxt(work / "mapped.csv", delimiter=",", skip_header=1)[:, :3]
            off = np.linalg.norm(mapped - (points @ place[:3, :3].T + place[:3, 3]), axis=1)
            known = np.isfinite(off)
            tissue = off[known & soft]
            print(f"{name}, {stage}: soft tissue {tissue.mean():.2f} mm, 95 % {np.percentile(tissue, 95):.2f}, "
                  f"most {tissue.max():.2f}; bones {off[known & ~soft].mean():.2f}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--shared", type=Path, required=True)
    parser.add_argument("--kinevox", default="build/bin/kinevox")
    parser.add_argument("--work", type=Path)
    args = parser.parse_args()

    def run(*words):
        subprocess.run([args.kinevox, *map(str, words), "--quiet"], check=True, stdout=subprocess.DEVNULL)
    with tempfile.TemporaryDirectory() as folder:
        work = args.work or Path(folder)
        work.mkdir(parents=True, exist_ok=True)
        (first, lps), truth = prepare(args.shared, work)
        run("segment", work / "echo1.nii.gz", "--seeds", work / "strokes.nii.gz", "--out", work / "bones.nii.gz",
            "--region", "custom")
        run("build", work / "study.json", "--out", work / "model")
        report(run, work, first, lps, truth)


if __name__ == "__main__":
    main()
