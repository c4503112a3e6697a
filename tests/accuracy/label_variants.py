"""Variants of label maps and bones, as tools leave them and people list them."""
import numpy as np
from scipy import ndimage

from variant import TEMPLATE, reordered, variant

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
