"""A study in memory, and what its variants do to it, by name."""
from dataclasses import dataclass
from pathlib import Path

import numpy as np

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


def reordered(values, affine, axes, flips):
    values = values.transpose(axes)
    affine = affine[:, [*axes, 3]].copy()
    for axis, flip in enumerate(flips):
        if flip:
            values = np.flip(values, axis)
            affine[:, 3] += affine[:, axis] * (values.shape[axis] - 1)
            affine[:, axis] *= -1
    return np.ascontiguousarray(values), affine
