#!/usr/bin/env python3
"""Studies of other anatomies with exact truth, from label maps of real bones (and the image, where there is one).

    tests/accuracy/other_anatomies.py --shared ../shared --out FOLDER [--only spine,ankle,knee]

spine: pelvis, femurs, T12 to L5 of a real CT, its own tissue and noise. ankle: tibia, talus, calcaneus of a real
child in invented tissue. knee: bones, cartilage and menisci of a real knee in invented tissue, region knee.
Bones move rigidly about their joints in small steps; in every step soft tissue is an elastic solid (8-node cells,
Poisson's ratio 0.45, fat softer than muscle) held by the bones, at rest where the last step left it. Written are
scans, labels, study.json, manifest.json and truth/poseNN_points.npz, as `kinevox phantom` writes them; evaluate with
`kinevox evaluate MODEL --truth FOLDER`. Needs numpy, scipy and nibabel.
"""
import argparse
import gzip
import json
from dataclasses import dataclass, field
from pathlib import Path

import nibabel
import numpy as np
from scipy import ndimage
from scipy.spatial.transform import Rotation

from elastic_solid import Grid, Solid, about, moved

POINTS = 20000
TISSUES = ["air", "fat", "muscle", "bone", "cartilage"]
FAT, MUSCLE, BONE, CARTILAGE = range(1, 5)


# --- anatomies ---

@dataclass
class Tissue:
    image: np.ndarray
    stiffness: np.ndarray  # 0 in air
    kind: np.ndarray  # index into TISSUES


@dataclass
class Anatomy:
    grid: Grid  # of the tissue, wider than the scans
    view: Grid  # of the scans
    labels: np.ndarray
    bones: dict  # label: name
    tissue: "Tissue"
    modality: str
    cell_mm: float
    steps: int = 10
    region: str = "custom"
    joints: list = field(default_factory=list)
    poses: list = field(default_factory=list)  # train or unseen, degrees by joint and axis

    def joint(self, child, parent, axes, near_mm, sphere, of="child", above_mm=0.0):
        """Centre: of the sphere through the child's surface that faces the parent, or the middle of what faces."""
        number = {name: label for label, name in self.bones.items()}
        grid = self.grid
        child_mask, parent_mask = self.labels == number[child], self.labels == number[parent]
        one, other = (child_mask, parent_mask) if of == "child" else (parent_mask, child_mask)
        facing = (one & ~ndimage.binary_erosion(one)
                  & (ndimage.distance_transform_edt(~other) * grid.spacing < near_mm))
        at = np.argwhere(facing) * grid.spacing + grid.origin
        centre = at.mean(0) + [0, 0, above_mm]
        if sphere:
            solved = np.linalg.lstsq(np.c_[2 * at, np.ones(len(at))], (at ** 2).sum(1), rcond=None)[0]
            centre = solved[:3]
        self.joints.append({"child": number[child], "parent": number[parent], "name": child, "cor": centre.tolist(),
                            "axes": {k: (np.array(v) / np.linalg.norm(v)).tolist() for k, v in axes.items()}})

    def parents(self):
        return {joint["child"]: joint["parent"] for joint in self.joints}

    def motions(self, angles, share):
        out = {label: np.eye(4) for label in self.bones}
        for joint in self.joints:  # parents first
            turn = np.eye(3)
            for axis, degrees in angles.get(joint["name"], {}).items():
                turn = turn @ Rotation.from_rotvec(np.radians(degrees * share) * np.array(joint["axes"][axis])).as_matrix()
            out[joint["child"]] = out[joint["parent"]] @ about(np.array(joint["cor"]), turn)
        return out


def texture(shape, widths, random):
    """Noise of unit deviation, a sum over widths in voxels."""
    out = np.zeros(shape)
    for width in widths:
        some = ndimage.gaussian_filter(random.standard_normal(shape), width)
        out += some / some.std()
    return out / out.std()


def resampled(labels, affine, spacing, margin, longer):
    """Labels on a RAS grid; bones that the map's faces cut go on for `longer` mm where the map is cut. And the view:
    what lies within `margin` of bones, not beyond those cuts."""
    step = np.linalg.norm(affine[:3, :3], axis=0)
    pads = []
    for axis in range(3):
        faces = [np.take(labels, end, axis).any() for end in (0, -1)]
        pads.append([int(longer / step[axis]) if cut else 0 for cut in faces])
    padded = np.pad(labels, pads, mode="edge")
    shifted = affine.copy()
    shifted[:3, 3] -= affine[:3, :3] @ [p[0] for p in pads]

    def box(mask, frame):
        at = np.argwhere(mask)[::7] @ frame[:3, :3].T + frame[:3, 3]
        return at.min(0), at.max(0)
    low, high = box(padded > 0, shifted)
    grid = Grid(low - margin, spacing, (high - low + 2 * margin) / spacing)
    inverse = np.linalg.inv(shifted)
    at = np.moveaxis(moved(inverse, grid.points()), -1, 0)
    out = ndimage.map_coordinates(padded, at, order=0, mode="constant")
    return grid, out, box(labels > 0, affine)


def invented(grid, labels, bones, others, random):
    """MR-like tissue around bones: a fat layer below the skin, muscle with strands, cortex and marrow."""
    mask = np.isin(labels, list(bones))
    away = ndimage.distance_transform_edt(labels == 0) * grid.spacing
    thickness = np.clip(15 + 3 * texture(grid.shape, [25 / grid.spacing], random), 11, None)
    hull = ndimage.binary_closing(np.pad(away < 10, 12), iterations=int(8 / grid.spacing))[12:-12, 12:-12, 12:-12]
    body = ndimage.distance_transform_edt(~hull) * grid.spacing < thickness - 8
    body = ndimage.gaussian_filter(body.astype(float), 1.5) > 0.5
    depth = ndimage.distance_transform_edt(body) * grid.spacing
    strands = ndimage.gaussian_filter(random.standard_normal(grid.shape), (1.2, 1.2, 7))
    strands += 1.8 * ndimage.gaussian_filter(random.standard_normal(grid.shape), (3, 3, 12))
    strands /= strands.std()
    fat = (depth < 4 + 1.2 * texture(grid.shape, [12], random)) | (texture(grid.shape, [7], random) > 1.5)
    image = np.where(body, np.where(fat, 185 + 12 * texture(grid.shape, [2, 4], random), 90 + 18 * strands), 0.0)
    image[body & (depth < 1.4)] = 100
    tissue = np.where(body, np.where(fat, FAT, MUSCLE), 0)
    for label, value in others.items():
        image[labels == label] = value
        tissue[labels == label] = CARTILAGE
    inner = ndimage.distance_transform_edt(mask) * grid.spacing
    image[mask] = (175 + 22 * texture(grid.shape, [1.5, 4], random))[mask]
    image[mask & (inner < 1.5)] = 22
    tissue[mask] = BONE
    stiffness = np.where(body, np.where(fat, 0.3, 1.0), 0.0)
    stiffness[np.isin(labels, list(others))] = 3
    return Tissue(image, stiffness, tissue)


def view_of(low, high, cut_below, cut_above, margin, spacing):
    """A box around the bones; less than them, along the limb, where the label map cuts them."""
    low, high = low - [margin, margin, -4 if cut_below else margin], high + [margin, margin, -4 if cut_above else margin]
    return Grid(low, spacing, np.round((high - low) / spacing))


def mapped(labels, names):
    out = np.zeros(labels.shape, np.int16)
    for n, (_, numbers) in enumerate(names, 1):
        out[np.isin(labels, numbers)] = n
    return out


def spine(shared, random):
    folder = shared / "data/torso-pelvis-ct"
    file = nibabel.load(folder / "example_ct.nii.gz")
    image = np.asanyarray(file.dataobj).astype(float)
    labels = np.asanyarray(nibabel.load(folder / "example_seg_fast_force_split.nii.gz").dataobj)
    names = [("pelvis", [25, 26, 77, 78]), ("femur_left", [75]), ("femur_right", [76]), ("l5", [27]), ("l4", [28]),
             ("l3", [29]), ("l2", [30]), ("l1", [31]), ("t12", [32])]
    pad = 12
    grid = Grid(file.affine[:3, 3] - 3 * pad, 3.0, np.array(image.shape) + 2 * pad)
    bones = mapped(labels, names)
    body = ndimage.binary_fill_holes(~ndimage.binary_opening(image < -500, iterations=2))
    body, image, bones = (np.pad(v, pad, mode="edge") for v in (body, image, bones))
    fat = image < -20
    view = Grid(file.affine[:3, 3] + 12, 3.0, np.array(labels.shape) - 8)
    tissue = Tissue(image, np.where(body, np.where(fat, 0.3, 1.0), 0.0), np.where(body, np.where(fat, FAT, MUSCLE), 0))
    out = Anatomy(grid, view, bones, {n: name for n, (name, _) in enumerate(names, 1)}, tissue, "ct", cell_mm=9.0, steps=5)
    for side in ("femur_left", "femur_right"):
        out.joint(side, "pelvis", {"flex": [1, 0, 0], "abduct": [0, 1, 0], "axial": [0, 0, 1]}, 9, True)
    chain = ["pelvis", "l5", "l4", "l3", "l2", "l1", "t12"]
    for parent, child in zip(chain, chain[1:]):
        out.joint(child, parent, {"flex": [1, 0, 0], "side": [0, 1, 0], "axial": [0, 0, 1]}, 12, False)

    def pose(flex, side, axial, left, right):
        share = {"l5": 1.3, "l4": 1.2, "l3": 1.0, "l2": 0.9, "l1": 0.8, "t12": 0.8}
        angles = {bone: {"flex": flex * s, "side": side * s, "axial": axial * s} for bone, s in share.items()}
        return {**angles, "femur_left": left, "femur_right": right}
    out.poses = [
        ("train", pose(5, 0, 0, {"flex": 25}, {"flex": -8})),
        ("train", pose(-4, 4, 0, {"flex": -8, "abduct": 10}, {"flex": 20})),
        ("train", pose(1, -5, 2, {"axial": 15}, {"abduct": -12, "axial": -10})),
        ("unseen", pose(3, 2, 0, {"flex": 14}, {"flex": 3})),
        ("unseen", pose(-1, -2, 1, {"flex": 3, "abduct": 5}, {"flex": 9}))]
    return out


def ankle(shared, random):
    file = nibabel.load(shared / "data/ankle-labels/ankle_label.nii.gz")
    grid, labels, (low, high) = resampled(np.asanyarray(file.dataobj), file.affine, 0.8, 22.0, 40.0)
    names = {1: "tibia", 2: "talus", 3: "calcaneus"}
    view = view_of(low, high, cut_below=False, cut_above=True, margin=18, spacing=1.1)
    out = Anatomy(grid, view, labels, names, invented(grid, labels, names, {}, random), "mr", cell_mm=5.0)
    out.joint("talus", "tibia", {"flex": [1, 0.1, 0.1], "invert": [0.1, 1, 0]}, 5, True)
    out.joint("calcaneus", "talus", {"invert": [0.2, 0.8, 0.6]}, 4, False)
    out.poses = [
        ("train", {"talus": {"flex": 20}, "calcaneus": {"invert": 4}}),
        ("train", {"talus": {"flex": -25, "invert": 3}, "calcaneus": {"invert": -6}}),
        ("train", {"talus": {"flex": 5, "invert": -3}, "calcaneus": {"invert": 12}}),
        ("unseen", {"talus": {"flex": 10}, "calcaneus": {"invert": 6}}),
        ("unseen", {"talus": {"flex": -12}, "calcaneus": {"invert": -2}})]
    return out


def read_nrrd(path):
    """Values and affine (RAS) of a gzipped NRRD in LPS."""
    raw = path.read_bytes()
    head, data = raw.split(b"\n\n", 1)
    fields = dict(line.split(": ", 1) for line in head.decode().splitlines() if ": " in line)
    shape = [int(n) for n in fields["sizes"].split()]
    kind = {"uchar": np.uint8, "unsigned char": np.uint8, "uint8": np.uint8, "short": np.int16}[fields["type"]]
    vectors = [np.array(v.split(","), float) for v in fields["space directions"].strip("()").split(") (")]
    affine = np.eye(4)
    affine[:3, :3] = np.array(vectors).T
    affine[:3, 3] = np.array(fields["space origin"].strip("()").split(","), float)
    return np.frombuffer(gzip.decompress(data), kind).reshape(shape, order="F"), np.diag([-1, -1, 1, 1]) @ affine


def knee(shared, random):
    labels, affine = read_nrrd(next((shared / "data/knee-dess-label").glob("*.nrrd")))
    names = {5: "femur", 6: "tibia", 8: "fibula", 7: "patella"}
    grid, labels, (low, high) = resampled(labels, affine, 0.9, 24.0, 60.0)
    tissue = invented(grid, labels, names, {1: 130, 2: 130, 3: 130, 4: 130, 9: 35, 10: 35}, random)
    view = view_of(low, high, cut_below=True, cut_above=True, margin=14, spacing=1.3)
    out = Anatomy(grid, view, labels, names, tissue, "mr", cell_mm=6.0, region="knee")
    out.joint("tibia", "femur", {"flex": [-1, 0, 0], "axial": [0, 0, 1]}, 8, False, "parent", 22.0)
    out.joint("fibula", "tibia", {"flex": [1, 0, 0]}, 8, False)
    out.joint("patella", "femur", {"flex": [-1, 0, 0]}, 12, False)
    out.joints[-1]["cor"] = out.joints[0]["cor"]
    out.poses = [(which, {"tibia": {"flex": flex, "axial": flex / 12}, "patella": {"flex": 0.6 * flex}})
                 for which, flex in (("train", 20), ("train", 42), ("train", 60), ("unseen", 30), ("unseen", 50))]
    return out


ANATOMIES = {"spine": spine, "ankle": ankle, "knee": knee}


def scanned(modality, values, random):
    """With the scanner's noise and, in MR, its shading."""
    if modality == "ct":
        return values + random.normal(0, 12, values.shape)
    i, j, k = np.ogrid[tuple(slice(-1, 1, n * 1j) for n in values.shape)]
    slopes = random.uniform(-0.12, 0.12, 6)
    bias = np.exp(slopes[0] * i + slopes[1] * j + slopes[2] * k + slopes[3] * i * j + slopes[4] * k * k + slopes[5] * i * i)
    return np.clip(np.hypot(values * bias + random.normal(0, 7, values.shape), random.normal(0, 7, values.shape)), 0, 400)


@dataclass
class Pose:
    """How a scan's points come from the template's."""
    anatomy: Anatomy
    solid: Solid
    motions: dict  # label: from the template, without the motion of the whole
    fields: list
    whole: np.ndarray

    def template_of(self, points):
        here = moved(np.linalg.inv(self.whole), points)
        out = self.solid.back(here, self.fields)
        for label, motion in self.motions.items():
            rigid = moved(np.linalg.inv(motion), here)
            inside = self.anatomy.grid.sample(self.anatomy.labels, rigid, order=0) == label
            out[inside] = rigid[inside]
        return out

    def carried(self, points, bone):
        """Template points, each of a bone or of none (0), to the scan."""
        out = self.solid.forward(points, self.fields)
        for label, motion in self.motions.items():
            out[bone == label] = moved(motion, points[bone == label])
        return moved(self.whole, out)


def motion_of_all(view, random):
    out = about(view.origin + np.array(view.shape) * view.spacing / 2,
                Rotation.from_rotvec(np.radians(random.uniform(-4, 4, 3))).as_matrix())
    out[:3, 3] += random.uniform(-6, 6, 3)
    return out


def material_points(anatomy, random):
    """Points of the body that the template shows, and their bones."""
    grid, view = anatomy.grid, anatomy.view
    points = view.points()
    points = points[grid.sample(anatomy.tissue.stiffness, points, order=0) > 0]
    points = points[random.choice(len(points), POINTS, replace=False)]
    points = points + random.uniform(-0.5, 0.5, points.shape) * view.spacing
    points = points[(grid.sample(anatomy.tissue.stiffness, points, order=0) > 0) & view.sees(points)]
    return points, grid.sample(bones_only(anatomy), points, order=0)


def bones_only(anatomy):
    return np.where(np.isin(anatomy.labels, list(anatomy.bones)), anatomy.labels, 0)


def write(anatomy, name, folder, random):
    (folder / "truth").mkdir(parents=True, exist_ok=True)
    grid, view, labels = anatomy.grid, anatomy.view, sorted(anatomy.bones)
    voxels = view.points()

    def save(stem, values, kind):
        nibabel.save(nibabel.Nifti1Image(values.astype(kind), view.affine()), folder / f"{stem}.nii.gz")
    save("bones_template", grid.sample(bones_only(anatomy), voxels, order=0), np.int16)
    image = anatomy.tissue.image
    shown = image if anatomy.modality == "ct" else ndimage.gaussian_filter(image, 0.5 * view.spacing / grid.spacing)
    solid = Solid(grid, {b: anatomy.labels == b for b in labels}, anatomy.tissue.stiffness, anatomy.cell_mm, anatomy.steps)
    points, bone = material_points(anatomy, random)
    to_joint = np.min([np.linalg.norm(points - np.array(j["cor"]), axis=1) for j in anatomy.joints], 0)
    manifest = {"kind": anatomy.region, "name": name, "bones": bone_list(anatomy), "joints": anatomy.joints,
                "poses": [], "tissues": TISSUES}
    for n, (which, angles) in enumerate([("train", {})] + anatomy.poses):
        stem = f"pose{n:02d}"
        fields = solid.fields_to(lambda share, angles=angles: anatomy.motions(angles, share)) if n else []
        pose = Pose(anatomy, solid, anatomy.motions(angles, 1.0), fields, motion_of_all(view, random) if n else np.eye(4))
        values = grid.sample(shown, pose.template_of(voxels), order=3, outside=image.min())
        values = np.clip(scanned(anatomy.modality, values, random), image.min(), None)
        save(stem, values, np.int16 if anatomy.modality == "ct" else np.float32)
        position = pose.carried(points, bone)
        np.savez(folder / "truth" / f"{stem}_points.npz", template=points, position=position, bone=bone.astype(np.uint8),
                 tissue=grid.sample(anatomy.tissue.kind, points, order=0).astype(np.uint8), in_fov=view.sees(position),
                 hidden=np.zeros(len(points), bool), dist_joint=to_joint.astype(np.float32))
        manifest["poses"].append({
            "index": n, "file": f"{stem}.nii.gz", "points": f"truth/{stem}_points.npz", "set": which, "angles": angles,
            "global_motion": pose.whole.tolist(), "T": [(pose.whole @ pose.motions[b]).tolist() for b in labels]})
        print(f"{name} {stem}: points moved by {np.linalg.norm(position - points, axis=1).mean():.1f} mm", flush=True)
    (folder / "manifest.json").write_text(json.dumps(manifest))
    (folder / "study.json").write_text(json.dumps(study_of(anatomy, name)))


def bone_list(anatomy):
    out, parents = [], anatomy.parents()
    for b in sorted(anatomy.bones):
        at = np.argwhere(anatomy.labels == b) * anatomy.grid.spacing + anatomy.grid.origin
        out.append({"label": b, "name": anatomy.bones[b], "parent": parents.get(b, 0),
                    "centroid": at[anatomy.view.sees(at)].mean(0).tolist()})
    return out


def study_of(anatomy, name):
    given = ["pose00"] + [f"pose{n:02d}" for n, (which, _) in enumerate(anatomy.poses, 1) if which == "train"]
    parents = anatomy.parents()
    return {"name": name, "region": anatomy.region, "template": "pose00",
            "scans": [{"name": scan, "volume": f"{scan}.nii.gz"} for scan in given],
            "bones": {"labels": "bones_template.nii.gz",
                      "list": [{"label": b, "name": anatomy.bones[b], "parent": anatomy.bones.get(parents.get(b))}
                               for b in sorted(anatomy.bones)]}}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--shared", type=Path, default=Path("../shared"))
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--only", default=",".join(ANATOMIES))
    arguments = parser.parse_args()
    for name in arguments.only.split(","):
        random = np.random.default_rng(7)
        write(ANATOMIES[name](arguments.shared, random), name, arguments.out / name, random)


if __name__ == "__main__":
    main()
