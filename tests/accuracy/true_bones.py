#!/usr/bin/env python3
"""Skinning alone: a phantom posed by its true bones, with our weights, beside perfect skinning (the truth's `lbs`).

    tests/accuracy/true_bones.py --kinevox build/bin/kinevox --dataset PHANTOM --region knee --work WORK

The model is built of the template and one scan; all training poses are asked from it with `--mode vbd`, their bones where the
manifest says. Printed: mean distance of the truth's points from where they are, over all of them, in soft tissue, and in soft
tissue within 10 mm of a joint; in brackets that of perfect skinning. Needs numpy.
"""
import argparse
import json
import subprocess
from pathlib import Path

import numpy as np

RAS = np.array([-1, -1, 1])  # from LPS, and back
NEAR_JOINT_MM = 10


def study_of(manifest, dataset, region, scan):
    name = {bone["label"]: bone["name"] for bone in manifest["bones"]}
    bones = [{"label": b["label"], "name": b["name"], "parent": name.get(b["parent"])} for b in manifest["bones"]]
    files = ["pose00", scan]
    return {
        "name": "true bones",
        "region": region,
        "template": "pose00",
        "scans": [{"name": f, "volume": str(dataset / f"{f}.nii.gz")} for f in files],
        "bones": {"labels": str(dataset / "bones_template.nii.gz"), "list": bones},
    }


def posed(kinevox, work, manifest, transforms, points):
    flip = np.diag([-1, -1, 1, 1])
    motions = {bone["name"]: (flip @ np.array(t).reshape(4, 4) @ flip).ravel().tolist()
               for bone, t in zip(manifest["bones"], transforms)}
    (work / "pose.json").write_text(json.dumps({"scan_from_template": motions}))
    np.savetxt(work / "in.csv", points * RAS, delimiter=",", header="x,y,z", comments="")
    subprocess.run([kinevox, "map-points", work / "model", "--pose", work / "pose.json", "--mode", "vbd", "--quiet", "--points",
                    work / "in.csv", "--out", work / "out.csv"], check=True)
    return np.loadtxt(work / "out.csv", delimiter=",", skiprows=1, usecols=(0, 1, 2)) * RAS


def distances(found, truth):
    off = np.linalg.norm(found - truth["position"], axis=1)
    counts = truth["in_fov"].astype(bool) & ~truth["hidden"].astype(bool)
    soft = counts & (truth["bone"] == 0)
    return [off[which].mean() for which in (counts, soft, soft & (truth["dist_joint"] < NEAR_JOINT_MM))]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kinevox", type=Path, required=True)
    parser.add_argument("--dataset", type=Path, required=True)
    parser.add_argument("--region", required=True)
    parser.add_argument("--work", type=Path, required=True)
    given = parser.parse_args()
    dataset, work, kinevox = given.dataset.resolve(), given.work.resolve(), given.kinevox.resolve()
    work.mkdir(parents=True, exist_ok=True)
    manifest = json.loads((dataset / "manifest.json").read_text())
    poses = [p for p in manifest["poses"] if p["set"] == "train" and p["index"] > 0]
    study = study_of(manifest, dataset, given.region, f"pose{poses[0]['index']:02d}")
    (work / "study.json").write_text(json.dumps(study))
    if not (work / "model").exists():
        subprocess.run([kinevox, "build", work / "study.json", "--out", work / "model", "--quiet"], check=True)
    ours, perfect = [], []
    for pose in poses:
        truth = np.load(dataset / pose["points"])
        ours.append(distances(posed(kinevox, work, manifest, pose["T"], truth["template"]), truth))
        perfect.append(distances(truth["lbs"], truth))
    for title, mine, best in zip(("all", "soft", "near joints"), np.mean(ours, 0), np.mean(perfect, 0)):
        print(f"{title:12} {mine:.3f} ({best:.3f})")


if __name__ == "__main__":
    main()
