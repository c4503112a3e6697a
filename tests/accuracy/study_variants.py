#!/usr/bin/env python3
"""How a phantom's model comes out of what users really have: label maps that tools left untidy, files in other
orders, views, voxels and units, scans that do not belong to the study.

    tests/accuracy/study_variants.py --kinevox build/bin/kinevox --dataset PHANTOM --scans pose01,pose02,pose03 \\
        --work WORK [--change pose02] [--only "as it is,dropped,mirrored"] [--stranger OTHER]

Each variant is a data set of its own below WORK with the true poses that belong to it; its model is built there and
compared. Variants of scans change those named, all without --change. Printed per variant: bones of 300 voxels and more
that miss 1.5 degrees or half a voxel (or how the build ended), those named as doubtful or uncertain, misses called
sure; MED after registration (where the frames are the phantom's) and CC; MED of soft tissue in the phantom's unseen
poses, posed with true bones by EVD and elastically; and what the build said. Needs numpy, scipy and nibabel.
"""
import argparse
import json
import subprocess
from pathlib import Path

import nibabel
import numpy as np

import label_variants  # noqa: F401  (they register)
import scan_variants  # noqa: F401
from bone_accuracy import bone_rows, counts_of
from variant import TEMPLATE, VARIANTS, Study


def name_of(pose):
    return pose["file"].split(".")[0]


def read(dataset, scans, changed):
    manifest = json.loads((dataset / "manifest.json").read_text())
    names = {bone["label"]: bone["name"] for bone in manifest["bones"]}

    def image(name):
        file = nibabel.load(dataset / f"{name}.nii.gz")
        values = np.asanyarray(file.dataobj)
        return values if name == "bones_template" else values.astype(np.float32), file.affine
    poses = {name_of(pose): [np.array(T, float).reshape(4, 4) for T in pose["T"]] for pose in manifest["poses"]}
    return manifest, Study(
        images={name: image(name) for name in (TEMPLATE, *scans)}, labels=image("bones_template"), poses=poses,
        bones=[{"label": b["label"], "name": b["name"], "parent": names.get(b["parent"])} for b in manifest["bones"]],
        changed=changed or list(scans), random=np.random.default_rng(7))


def write(study, manifest, folder):
    folder.mkdir(parents=True, exist_ok=True)
    for name, (values, affine) in {**study.images, "labels": study.labels}.items():
        if values.dtype in (np.int64, np.float64):
            values = values.astype(np.float32 if values.dtype == np.float64 else np.int32)
        nibabel.save(nibabel.Nifti1Image(values, affine), folder / f"{name}.nii.gz")
    for pose in manifest["poses"]:
        pose["T"] = [T.tolist() for T in study.poses[name_of(pose)]]
    (folder / "manifest.json").write_text(json.dumps(manifest))
    (folder / "study.json").write_text(json.dumps({
        "name": folder.name, "region": study.region or manifest["kind"], "template": TEMPLATE,
        "scans": [{"name": name, "volume": f"{name}.nii.gz"} for name in study.images],
        "bones": {"labels": "labels.nii.gz", "list": study.bones}}))


def run(*command):
    ended = subprocess.run([str(part) for part in command], capture_output=True, text=True, check=False)
    return ended.returncode, ended.stdout, ended.stderr


def build_and_compare(kinevox, folder, dataset, study):
    rc, _, said = run(kinevox, "build", folder / "study.json", "--out", folder / "model", "--quiet")
    if rc != 0:
        return f"rc {rc} | | | | | | | {said.strip()}"
    info = json.loads(run(kinevox, "info", folder / "model", "--json")[1])
    manifest = json.loads((folder / "manifest.json").read_text())
    counts = counts_of(list(bone_rows(info, manifest)), info)
    tables = run(kinevox, "evaluate", folder / "model", "--truth", dataset, "--json", "--quiet")[1]
    return (f"{counts['misses']} of {counts['bones']} | {counts['named']} | {counts['silent']} | "
            f"{measures(json.loads(tables), manifest, study.same_frames)} | " + " ".join(said.split("\n")))


def measures(tables, manifest, same_frames):
    registered = tables["table"][-1] if tables["table"] else {}
    kept_back = [name_of(pose) for pose in manifest["poses"] if pose["set"] == "unseen"]
    values = [registered.get("med") if same_frames else None, registered.get("cc")]
    for mode in ("evd", "elastic"):
        unseen = [pose["distances"][mode]["soft"] for pose in tables["unseen"] if pose["name"] in kept_back]
        values.append(np.mean(unseen) if unseen else None)
    return " | ".join("–" if value is None else f"{value:.2f}" for value in values)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kinevox", default="build/bin/kinevox")
    parser.add_argument("--dataset", type=Path, required=True)
    parser.add_argument("--scans", default="pose02")
    parser.add_argument("--change", default="")
    parser.add_argument("--stranger", type=Path, help="a phantom of another seed, for the variant 'another person'")
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--only", help="default: all")
    arguments = parser.parse_args()
    usual = [name for name in VARIANTS if arguments.stranger or name != "another person"]
    for name in arguments.only.split(",") if arguments.only else usual:
        changed = [scan for scan in arguments.change.split(",") if scan]
        manifest, study = read(arguments.dataset, arguments.scans.split(","), changed)
        study.stranger = arguments.stranger
        VARIANTS[name](study)
        folder = arguments.work / name.replace(" ", "-")
        write(study, manifest, folder)
        print(f"| {name} | {build_and_compare(arguments.kinevox, folder, arguments.dataset, study)}", flush=True)


if __name__ == "__main__":
    main()
