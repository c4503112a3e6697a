#!/usr/bin/env python3
"""What is wrong with bones and joints the same way in many data sets: signed errors, which sizes hide.

    tests/accuracy/systematic_errors.py MODEL=PHANTOM [MODEL=PHANTOM ...] [--kinevox build/bin/kinevox]

MODEL: made by `kinevox build` from PHANTOM, a folder that `kinevox phantom` wrote. Per bone and joint: mean and
standard deviation over all scans (of joints: over all models), along the bone, across its width, across its thickness.
Bones: turns in degrees and centroids in mm, in the template's frame. Joints that move by at least 20 degrees: the
centre in mm across the true axis, and the first axis in degrees, both along the bone and across bone and axis. Turns about a bone's length are the least
certain. A mean that is several times its deviation over the root of the number of sets is no noise.
"""
import argparse
import collections
import json
import subprocess
from pathlib import Path

import numpy as np

from bone_accuracy import bone_poses, moving_joints


def info_of(kinevox, model):
    return json.loads(subprocess.run([kinevox, "info", model, "--json"], check=True, capture_output=True).stdout)


def axes_of(bone):
    """Columns: along it, across its width, across its thickness."""
    return np.array(bone["obb"]["axes"]).reshape(3, 3)


def turn_deg(rotation):
    """Of a small rotation, about each axis."""
    skew = (rotation - rotation.T) / 2
    return np.degrees([skew[2, 1], skew[0, 2], skew[1, 0]])


def bone_errors(info, manifest):
    for _, bone, found, true in bone_poses(info, manifest):
        off, centre = np.linalg.inv(true) @ found, np.append(bone["centroid"], 1.0)
        yield bone["name"], axes_of(bone).T @ turn_deg(off[:3, :3]), axes_of(bone).T @ (off @ centre - centre)[:3]


def joint_errors(info, manifest):
    bones = {bone["name"]: bone for bone in info["bones"]}
    for joint, _, centre, axis in moving_joints(info, manifest):
        bone = bones[joint["child"]]
        along = axes_of(bone)[:, 0]
        along = along * np.sign(along @ (np.array(bone["centroid"]) - centre))
        along -= axis * (axis @ along)
        along /= np.linalg.norm(along)
        directions = np.array([along, np.cross(axis, along)])
        first = np.array(joint["dofs"][0]["axis"])
        yield (joint["child"], directions @ (np.array(joint["centre"]) - centre),
               directions @ np.degrees(first * np.sign(first @ axis)))


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
