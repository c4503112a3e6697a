#!/usr/bin/env python3
"""How far a model's bones and joints are from a phantom's truth.

    kinevox info MODEL --json | tests/accuracy/bone_accuracy.py PHANTOM/manifest.json

Bones: rotation in degrees and centroid in mm of every scan. Joints that move by at least 20 degrees: distance of the
centre from the true axis and angle to the dominant true axis. What misses an aim is listed; a bone is named when
it is called doubtful or uncertain, and a miss is silent when the bone is called sure. Bounds hold where an error is no
larger than `turn_within_deg`.
"""
import json
import sys

import numpy as np

FLIP = np.diag([-1.0, -1.0, 1.0, 1.0])  # the manifest is RAS, info is LPS
LARGE_VOXELS, TURN_AIM_DEG, CENTRE_AIM_MM, AXIS_AIM_DEG, MOVES_DEG = 300, 1.5, 1.5, 3.0, 20.0


def angle_deg(rotation):
    return np.degrees(np.arccos(np.clip((np.trace(rotation) - 1) / 2, -1, 1)))


def bone_poses(info, manifest):
    """Scan and bone (of info), and where the scan has the bone: found and true, 4 x 4, scan from template, LPS mm."""
    order = {bone["name"]: n for n, bone in enumerate(manifest["bones"])}
    truth = {pose["file"].split(".")[0]: pose["T"] for pose in manifest["poses"]}
    for scan in info["scans"]:
        for bone in info["bones"]:
            true = np.array(truth[scan["name"]][order[bone["name"]]], float).reshape(4, 4)
            found = np.array(scan["scan_from_template"][bone["name"]], float).reshape(4, 4)
            yield scan, bone, found, FLIP @ true @ FLIP


def bone_rows(info, manifest):
    for scan, bone, found, true in bone_poses(info, manifest):
        fit = scan["bone_fits"][bone["name"]]
        yield {"scan": scan["name"], "bone": bone["name"], "voxels": bone["voxels"],
               "turn_deg": angle_deg(found[:3, :3].T @ true[:3, :3]),
               "centre_mm": np.linalg.norm((found - true) @ np.append(bone["centroid"], 1.0)),
               "certainty": fit["certainty"], "turn_within_deg": fit["turn_within_deg"]}


def misses(row, info):
    return row["turn_deg"] > TURN_AIM_DEG or row["centre_mm"] > 0.5 * np.mean(info["volume"]["spacing"])


def counts_of(rows, info):
    large = [row for row in rows if row["voxels"] >= LARGE_VOXELS]
    missed = [row for row in large if misses(row, info)]
    return {"bones": len(large), "misses": len(missed),
            "named": sum(row["certainty"] in ("uncertain", "doubtful") for row in large),
            "named misses": sum(row["certainty"] in ("uncertain", "doubtful") for row in missed),
            "silent": sum(row["certainty"] == "sure" for row in missed)}


def moving_joints(info, manifest):
    """Joints (of info) that turn far enough: how far, and the true centre and axis that they turn about most, LPS mm."""
    label_name = {bone["label"]: bone["name"] for bone in manifest["bones"]}
    trained = {scan["name"] for scan in info["scans"]}
    found = {joint["child"]: joint for joint in info["joints"] if joint["dofs"]}
    for true in manifest["joints"]:
        name = label_name[true["child"]]
        moved = {dof: max(abs(pose["angles"].get(name, {}).get(dof, 0.0)) for pose in manifest["poses"]
                          if pose["file"].split(".")[0] in trained) for dof in true["axes"]}
        dof = max(moved, key=moved.get)
        if name not in found or moved[dof] < MOVES_DEG:
            continue
        axis = FLIP[:3, :3] @ np.array(true["axes"][dof])
        yield found[name], moved[dof], FLIP[:3, :3] @ np.array(true["cor"]), axis / np.linalg.norm(axis)


def joint_rows(info, manifest):
    for joint, moved_deg, centre, axis in moving_joints(info, manifest):
        off = np.array(joint["centre"]) - centre
        cosine = max(abs(axis @ np.array(d["axis"])) for d in joint["dofs"])
        yield {"joint": joint["child"], "moved_deg": moved_deg, "axis_deg": np.degrees(np.arccos(min(1.0, cosine))),
               "centre_mm": np.linalg.norm(off - axis * (axis @ off))}


def main():
    info = json.load(sys.stdin)
    with open(sys.argv[1], encoding="utf-8") as file:
        manifest = json.load(file)
    rows = list(bone_rows(info, manifest))
    large = [row for row in rows if row["voxels"] >= LARGE_VOXELS]
    for name, some in (("large bones", large), ("all bones", rows)):
        turns, centres = [row["turn_deg"] for row in some], [row["centre_mm"] for row in some]
        print(f"{name}: {len(some)}, rotation {np.median(turns):.2f} {np.quantile(turns, 0.9):.2f} {max(turns):.2f} deg, "
              f"centroid {np.median(centres):.2f} {max(centres):.2f} mm")
    counts = counts_of(rows, info)
    print(f"large bones that miss: {counts['misses']}, of them named {counts['named misses']}, called sure "
          f"{counts['silent']}; named as doubtful or uncertain: {counts['named']}")
    told = [row for row in rows if row["certainty"] != "doubtful"]
    within = sum(row["turn_deg"] <= row["turn_within_deg"] for row in told)
    print(f"turned by no more than stated: {within} of {len(told)} bones that are not doubtful")
    for row in large:
        if misses(row, info):
            print(f"  {row['scan']} {row['bone']}: {row['turn_deg']:.2f} deg, {row['centre_mm']:.2f} mm, "
                  f"{row['certainty']}")
    for row in joint_rows(info, manifest):
        missed = row["axis_deg"] > AXIS_AIM_DEG or row["centre_mm"] > CENTRE_AIM_MM
        print(f"joint {row['joint']} ({row['moved_deg']:.0f} deg): axis {row['axis_deg']:.2f} deg, "
              f"centre {row['centre_mm']:.2f} mm" + (", misses" if missed else ""))


if __name__ == "__main__":
    main()
