#!/usr/bin/env python3
"""How a phantom's model comes out of what users really have: label maps that tools left untidy, files in other
orders, views, voxels and units, scans that do not belong to the study.

    tests/bench/study_variants.py --kinevox build/bin/kinevox --dataset PHANTOM --scans pose01,pose02,pose03 \\
        --work WORK [--change pose02] [--only "as it is,dropped,mirrored"] [--stranger OTHER]

Each variant is a data set of its own below WORK with the true poses that belong to it; its model is built there and
compared. Variants of scans change those named, all without --change. Printed per variant: bones of 300 voxels and more
that miss 1.5 degrees or half a voxel (or how the build ended), those named as doubtful or uncertain, misses called
sure; MED after registration (where the frames are the phantom's) and CC; MED of soft tissue in the phantom's unseen
poses, posed by EVD with true bones; and what the build said. Needs numpy, scipy and nibabel.
"""
import argparse
import json
import subprocess
from dataclasses import dataclass
from pathlib import Path

import nibabel
import numpy as np
from scipy import ndimage

from bone_accuracy import bone_rows, counts_of

TEMPLATE = "pose00"


@dataclass
class Study:
    """A phantom's files in memory; a variant changes what it likes."""
    images: dict  # name: (values, affine)
    labels: tuple  # values, affine
    poses: dict  # name: bones x 4 x 4, RAS
    bones: list  # label, name, parent
    changed: list  # names of scans
    same_frames: bool = True  # points of the truth still hold
    random: np.random.Generator = None
    stranger: Path = None
    region: str = ""  # the phantom's own

    def change_labels(self, change):
        values, affine = self.labels
        out = values.copy()
        for bone in self.bones:
            change(values, bone["label"], out)
        self.labels = out, affine

    def change_scans(self, change):
        for name in self.changed:
            self.images[name] = change(*self.images[name])

    def change_all(self, change):
        for name in self.images:
            self.images[name] = change(*self.images[name])

    def move(self, name, motion):
        """Carries a scan's frame."""
        values, affine = self.images[name]
        self.images[name] = values, motion @ affine
        self.poses[name] = [motion @ pose for pose in self.poses[name]]
        self.same_frames = False


VARIANTS = {}


def variant(function):
    VARIANTS[function.__name__.replace("_", " ")] = function
    return function


@variant
def as_it_is(study):
    pass


# --- label maps ---

@variant
def specks(study):
    body = np.argwhere(study.images[TEMPLATE][0] > 60)

    def change(values, label, out):
        for at in body[study.random.integers(len(body), size=2)]:
            out[tuple(at)] = label
    study.change_labels(change)


@variant
def hollow(study):
    def change(values, label, out):
        out[ndimage.binary_erosion(values == label, iterations=2)] = 0
    study.change_labels(change)


@variant
def marrow_apart(study):
    def change(values, label, out):
        out[ndimage.binary_erosion(values == label, iterations=1)] = 100 + label
    study.change_labels(change)


@variant
def thick(study):
    def change(values, label, out):
        out[ndimage.binary_dilation(values == label) & (values == 0) & (out == 0)] = label
    study.change_labels(change)


@variant
def thin(study):
    def change(values, label, out):
        inside = ndimage.binary_erosion(values == label)
        if inside.sum() > 20:
            out[(values == label) & ~inside] = 0
    study.change_labels(change)


@variant
def rough(study):
    """The border wrong by a voxel here and there, both ways."""
    def change(values, label, out):
        bone = values == label
        coin = study.random.random(values.shape) < 0.4
        out[(bone & ~ndimage.binary_erosion(bone)) & coin] = 0
        out[(ndimage.binary_dilation(bone) & (values == 0)) & coin & (out == 0)] = label
    study.change_labels(change)


@variant
def slice_by_slice(study):
    """Drawn in every third slice, copied to its neighbours."""
    values, affine = study.labels
    nearest = np.clip(np.round(np.arange(values.shape[2]) / 3) * 3, 0, values.shape[2] - 1).astype(int)
    study.labels = values[:, :, nearest], affine


@variant
def coarse_labels(study):
    """Labels on a grid of their own, with voxels twice as wide."""
    values, affine = study.labels
    coarse = values[::2, ::2, ::2]
    study.labels = coarse, affine @ np.diag([2, 2, 2, 1.0])


@variant
def labels_turned(study):
    """The same map, stored in another order of axes."""
    values, affine = study.labels
    study.labels = reordered(values, affine, (2, 0, 1), (True, False, True))


@variant
def labels_as_float(study):
    values, affine = study.labels
    study.labels = values.astype(np.float32), affine


@variant
def labels_shifted(study):
    """The map's header is off by two voxels."""
    values, affine = study.labels
    shift = np.eye(4)
    shift[0, 3] = 2 * affine[0, 0]
    study.labels = values, shift @ affine


@variant
def one_bone_missing(study):
    """The label of the last bone is in the list and not in the map."""
    values, affine = study.labels
    study.labels = np.where(values == study.bones[-1]["label"], 0, values), affine


@variant
def two_bones_swapped(study):
    """The names of the last two bones changed places."""
    a, b = study.bones[-1], study.bones[-2]
    a["label"], b["label"] = b["label"], a["label"]
    study.same_frames = False


# --- trees, of region custom ---

def hang_on(study, parent_of):
    """Every bone but the first on the one of this index."""
    for n, bone in enumerate(study.bones[1:], 1):
        bone["parent"] = study.bones[parent_of(n)]["name"]
    study.region = "custom"


@variant
def own_tree(study):
    study.region = "custom"


@variant
def all_on_the_first(study):
    hang_on(study, lambda n: 0)


@variant
def each_on_the_one_before(study):
    hang_on(study, lambda n: n - 1)


# --- files ---

def reordered(values, affine, axes, flips):
    values = values.transpose(axes)
    affine = affine[:, [*axes, 3]].copy()
    for axis, flip in enumerate(flips):
        if flip:
            values = np.flip(values, axis)
            affine[:, 3] += affine[:, axis] * (values.shape[axis] - 1)
            affine[:, axis] *= -1
    return np.ascontiguousarray(values), affine


@variant
def axes_in_another_order(study):
    study.change_scans(lambda values, affine: reordered(values, affine, (1, 2, 0), (False, True, False)))


@variant
def all_in_another_order(study):
    study.change_all(lambda values, affine: reordered(values, affine, (2, 1, 0), (True, False, False)))
    study.labels = reordered(*study.labels, (2, 1, 0), (True, False, False))


@variant
def small_numbers(study):
    study.change_scans(lambda values, affine: (values / 1e5, affine))


def give_air_noise(study):
    """Air of one value becomes the noise of a magnitude image."""
    def change(values, affine):
        noise = np.hypot(*study.random.normal(0, 6, (2, *values.shape)))
        return np.where(values < 20, noise, values), affine
    study.change_all(change)


@variant
def hounsfield_padding_noisy_air(study):
    give_air_noise(study)
    hounsfield_padding(study)


@variant
def hounsfield_padding(study):
    """As from CT: air at -1024, and -3024 outside a round field."""
    def change(values, affine):
        n = np.array(values.shape[:2])
        i, j = np.ogrid[:n[0], :n[1]]
        outside = ((i - n[0] / 2) / (n[0] / 2)) ** 2 + ((j - n[1] / 2) / (n[1] / 2)) ** 2 > 1
        out = values.astype(float) * 5 - 1024
        out[outside] = -3024
        return out, affine
    study.change_all(change)


def shares_of_view(values):
    """0 .. 1 along each axis."""
    return np.ogrid[tuple(slice(0, 1, n * 1j) for n in values.shape)]


@variant
def not_a_number_outside(study):
    """NaN where the view was resampled from elsewhere: a wedge at a corner."""
    def change(values, affine):
        i, j, k = shares_of_view(values)
        out = values.astype(np.float32)
        out[np.broadcast_to(i + j + k < 0.6, values.shape)] = np.nan
        return out, affine
    study.change_scans(change)


@variant
def zero_wedge_noisy_air(study):
    give_air_noise(study)
    zero_wedge(study)


@variant
def zero_wedge(study):
    """Zero where the view was resampled from elsewhere: an oblique cut through the limb's end."""
    def change(values, affine):
        i, j, _ = shares_of_view(values)
        out = values.copy()
        out[np.broadcast_to(i + j < 0.7, values.shape)] = 0
        return out, affine
    study.change_scans(change)


@variant
def wide_air(study):
    """A view twice as wide, of air with its noise."""
    def change(values, affine):
        pad = [(n // 2, n // 2) for n in values.shape]
        out = np.pad(values, pad)
        noise = np.hypot(*study.random.normal(0, 6, (2, *out.shape)))
        inside = np.pad(np.ones(values.shape, bool), pad)
        out = np.where(inside, out, noise)
        affine = affine.copy()
        affine[:3, 3] -= affine[:3, :3] @ [p[0] for p in pad]
        return out, affine
    study.change_scans(change)


@variant
def thick_slices(study):
    """Slices three voxels thick, summed as a scanner does."""
    def change(values, affine):
        n = values.shape[2] // 3
        out = values[:, :, :3 * n].reshape(*values.shape[:2], n, 3).mean(3)
        affine = affine.copy()
        affine[:3, 3] += affine[:3, 2]
        affine[:3, 2] *= 3
        return out, affine
    study.change_scans(change)


@variant
def far_away(study):
    for name in study.changed:
        motion = np.eye(4)
        motion[:3, 3] = [900, -1200, 1500]
        study.move(name, motion)


@variant
def in_metres(study):
    def change(values, affine):
        return values, np.diag([1e-3, 1e-3, 1e-3, 1]) @ affine
    study.change_scans(change)
    study.same_frames = False


@variant
def coil(study):
    """A surface coil: bright on one side, a tenth on the other."""
    def change(values, affine):
        return values * np.geomspace(2, 0.2, values.shape[0])[:, None, None], affine
    study.change_all(change)


@variant
def ghosts(study):
    """The limb again at a quarter of its brightness, half a view away, as motion leaves it."""
    study.change_scans(lambda values, affine: (values + 0.25 * np.roll(values, values.shape[1] // 2, 1), affine))


@variant
def metal(study):
    """A signal void of 2 cm with a bright rim in the middle of the limb."""
    def change(values, affine):
        spacing = np.linalg.norm(affine[:3, :3], axis=0)
        middle = np.array(ndimage.center_of_mass(values > 60))
        i, j, k = np.ogrid[tuple(slice(0, n) for n in values.shape)]
        away = np.sqrt(sum(((x - c) * s) ** 2 for x, c, s in zip((i, j, k), middle, spacing)))
        out = values.copy()
        out[away < 12] = 350
        out[away < 10] = 2
        return out, affine
    study.change_scans(change)


@variant
def wrapped(study):
    """The view too small along the limb's breadth: a fifth of it comes in again on the other side."""
    def change(values, affine):
        n = values.shape[1] // 5
        affine = affine.copy()
        affine[:3, 3] -= n * affine[:3, 1]
        return np.roll(values, n, 1), affine
    study.change_scans(change)


@variant
def uneven_slices(study):
    """Every other slice darker by a quarter, as slices taken in two passes."""
    def change(values, affine):
        out = values.copy()
        out[:, :, ::2] *= 0.75
        return out, affine
    study.change_scans(change)


@variant
def moved_halfway(study):
    """The limb shifted by 4 mm while slices were taken: the second half of them lies elsewhere."""
    def change(values, affine):
        spacing = np.linalg.norm(affine[:3, :3], axis=0)
        out, half = values.copy(), values.shape[2] // 2
        shift = [4 / spacing[0], 0, 0]
        out[:, :, half:] = ndimage.shift(values[:, :, half:], shift, order=1, mode="nearest")
        return out, affine
    study.change_scans(change)


@variant
def saturated(study):
    """Whatever is brighter than half of the body has one value."""
    study.change_scans(lambda values, affine: (np.minimum(values, np.median(values[values > 60])), affine))


@variant
def few_greys(study):
    """Twelve greys."""
    study.change_scans(lambda values, affine: (np.round(values / values.max() * 11), affine))


@variant
def table_and_cast(study):
    """A bright plate below the limb and a shell around it, as padding and casts show."""
    def change(values, affine):
        body = ndimage.binary_fill_holes(ndimage.binary_opening(values > 60))
        gap = ndimage.binary_dilation(body, iterations=2)
        shell = ndimage.binary_dilation(gap, iterations=2) & ~gap
        out = values.copy()
        out[shell] = 120
        out[:, 2:5, :] = np.where(body[:, 2:5, :], out[:, 2:5, :], 150)
        return out, affine
    study.change_scans(change)


@variant
def scanner_table(study):
    """Air at -1024 and a plate of two voxels below the limb, which it touches, in every scan."""
    def change(values, affine):
        body = ndimage.binary_opening(values > 60)
        low = np.argwhere(body)[:, 0].min()
        out = values.copy()
        plate = slice(max(low - 2, 0), max(low, 2))
        out[plate] = np.where(body[plate], out[plate], 130)
        return out, affine
    study.change_all(change)
    make_hounsfield(study)


@variant
def both_legs(study):
    """The other leg beside the limb, its mirror image, in every scan; not in the label map."""
    def change(values, affine):
        affine = affine.copy()
        affine[:3, 3] -= affine[:3, 2] * values.shape[2]
        return np.concatenate([values[:, :, ::-1], values], axis=2), affine
    study.change_all(change)


@variant
def both_legs_in_the_scan(study):
    """The other leg beside the limb, its mirror image, where the template shows one."""
    def change(values, affine):
        return np.concatenate([values, values[:, :, ::-1]], axis=2), affine
    study.change_scans(change)


@variant
def ct_cast(study):
    """As from CT, a shell around the limb in every scan."""
    study.changed = list(study.images)
    table_and_cast(study)
    make_hounsfield(study)


def make_hounsfield(study):
    study.change_all(lambda values, affine: (values.astype(float) * 5 - 1024, affine))


# --- scans that do not belong ---

@variant
def template_again(study):
    for name in study.changed:
        study.images[name] = study.images[TEMPLATE]
        study.poses[name] = [np.eye(4) for _ in study.poses[name]]
    study.same_frames = False


@variant
def dropped(study):
    for name in study.changed:
        del study.images[name]


@variant
def mirrored(study):
    """The other hand or leg: image data flipped, frame kept."""
    study.change_scans(lambda values, affine: (values[::-1], affine))
    study.same_frames = False


@variant
def only_noise(study):
    study.change_scans(lambda values, affine: (np.hypot(*study.random.normal(0, 20, (2, *values.shape))), affine))
    study.same_frames = False


@variant
def constant_image(study):
    study.change_scans(lambda values, affine: (np.full(values.shape, 7.0), affine))


@variant
def voxels_too_long(study):
    """Slices given as 5 % farther apart than they are."""
    study.change_scans(lambda values, affine: (values, affine @ np.diag([1, 1, 1.05, 1])))
    study.same_frames = False


@variant
def voxel_sizes_lost(study):
    """Voxels of 1 mm along the patient's axes, whatever they were."""
    study.change_scans(lambda values, affine: (values, np.eye(4)))
    study.same_frames = False


@variant
def another_person(study):
    """The same scan of the phantom --stranger."""
    for name in study.changed:
        file = nibabel.load(study.stranger / f"{name}.nii.gz")
        study.images[name] = np.asanyarray(file.dataobj).astype(np.float32), file.affine
    study.same_frames = False


@variant
def upside_down_other_contrast(study):
    for name in study.changed:
        values, affine = study.images[name]
        x = np.clip(values / np.percentile(values, 99.5), 0, 1)
        study.images[name] = 255 * (0.15 * x + 3.2 * x * (1 - x)), affine
        study.move(name, np.diag([1.0, -1, -1, 1]))


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
        return f"rc {rc} | | | | | | {said.strip()}"
    info = json.loads(run(kinevox, "info", folder / "model", "--json")[1])
    manifest = json.loads((folder / "manifest.json").read_text())
    counts = counts_of(list(bone_rows(info, manifest)), info)
    tables = run(kinevox, "evaluate", folder / "model", "--truth", dataset, "--json", "--quiet")[1]
    return (f"{counts['misses']} of {counts['bones']} | {counts['named']} | {counts['silent']} | "
            f"{measures(json.loads(tables), manifest, study.same_frames)} | " + " ".join(said.split("\n")))


def measures(tables, manifest, same_frames):
    registered = tables["table"][-1] if tables["table"] else {}
    kept_back = [name_of(pose) for pose in manifest["poses"] if pose["set"] == "unseen"]
    unseen = [pose["distances"]["evd"]["soft"] for pose in tables["unseen"] if pose["name"] in kept_back]
    values = [registered.get("med") if same_frames else None, registered.get("cc"), np.mean(unseen) if unseen else None]
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
