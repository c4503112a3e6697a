#!/usr/bin/env python3
"""What is wrong with bones and joints the same way in many data sets: signed errors, which sizes hide.

    tests/bench/systematic_errors.py MODEL=PHANTOM [MODEL=PHANTOM ...] [--kinevox build/bin/kinevox]

MODEL: made by `kinevox build` from PHANTOM, a folder that `kinevox phantom` wrote. Per bone and joint: mean and
standard deviation over all scans (of joints: over all models), along the bone, across its width, across its thickness.
Bones: turns in degrees and centroids in mm, in the template's frame. Joints: the centre in mm across the stated axis,
and the first axis in degrees, both along the bone and across bone and axis. Turns about a bone's length are the least
certain. A mean that is several times its deviation over the root of the number of sets is no noise.
"""
import argparse
import collections
import json
import subprocess
from pathlib import Path

import numpy as np

FLIP = np.diag([-1.0, -1.0, 1.0, 1.0])  # the manifest is RAS, info is LPS


def info_of(kinevox, model):
    return json.loads(subprocess.run([kinevox, "info", model, "--json"], check=True, capture_output=True).stdout)


def turn_deg(rotation):
    skew = (rotation - rotation.T) / 2
    return np.degrees([skew[2, 1], skew[0, 2], skew[1, 0]])


def bone_errors(info, manifest):
    order = {bone["name"]: n for n, bone in enumerate(manifest["bones"])}
    truth = {Path(pose["file"]).name.split(".")[0]: pose["T"] for pose in manifest["poses"]}
    for scan in info["scans"]:
        if scan["name"] == info["template"]:
            continue
        for bone in info["bones"]:
            true = FLIP @ np.array(truth[scan["name"]][order[bone["name"]]], float).reshape(4, 4) @ FLIP
            off = np.linalg.inv(true) @ np.array(scan["scan_from_template"][bone["name"]], float).reshape(4, 4)
            axes, centre = np.array(bone["obb"]["axes"]).reshape(3, 3), np.append(bone["centroid"], 1.0)
            yield bone["name"], axes.T @ turn_deg(off[:3, :3]), axes.T @ (off @ centre - centre)[:3]


def joint_errors(info, manifest):
    bones = {bone["name"]: bone for bone in info["bones"]}
    joints = {joint["child"]: joint for joint in info["joints"] if joint["dofs"]}
    names = {bone["label"]: bone["name"] for bone in manifest["bones"]}
    for true in manifest["joints"]:
        name = names[true["child"]]
        if name not in joints:
            continue
        axis = FLIP[:3, :3] @ np.array(next(iter(true["axes"].values())))
        axis /= np.linalg.norm(axis)
        centre = FLIP[:3, :3] @ np.array(true["cor"])
        along = np.array(bones[name]["obb"]["axes"]).reshape(3, 3)[:, 0]
        along = along * np.sign(along @ (np.array(bones[name]["centroid"]) - centre))
        along -= axis * (axis @ along)
        along /= np.linalg.norm(along)
        across = np.cross(axis, along)
        off, found = np.array(joints[name]["centre"]) - centre, np.array(joints[name]["dofs"][0]["axis"])
        tilt = np.degrees(found * np.sign(found @ axis))
        yield name, np.array([off @ along, off @ across]), np.array([tilt @ along, tilt @ across])


def text(errors):
    return "  ".join(f"{mean:6.2f} ± {deviation:.2f}" for mean, deviation in zip(np.mean(errors, 0), np.std(errors, 0)))


def report(title, units, errors):
    print(f"{title}\n{'':14}{units[0]:48}{units[1]}")
    for name, pairs in errors.items():
        print(f"{name:14}{text([a for a, _ in pairs]):48}{text([b for _, b in pairs])}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pairs", nargs="+", metavar="MODEL=PHANTOM")
    parser.add_argument("--kinevox", default="build/bin/kinevox")
    args = parser.parse_args()
    bones, joints = collections.defaultdict(list), collections.defaultdict(list)
    for pair in args.pairs:
        model, _, phantom = pair.partition("=")
        info = info_of(args.kinevox, model)
        manifest = json.loads(Path(phantom, "manifest.json").read_text(encoding="utf-8"))
        for name, turn, shift in bone_errors(info, manifest):
            bones[name].append((turn, shift))
        for name, centre, tilt in joint_errors(info, manifest):
            joints[name].append((centre, tilt))
    report("bones", ("turn, degrees", "centroid, mm"), bones)
    report("joints", ("centre, mm", "first axis, degrees"), joints)


if __name__ == "__main__":
    main()
