"""Tissue as an elastic solid that bones carry along in small steps."""
from inspect import signature

import numpy as np
from scipy import ndimage
from scipy.sparse.linalg import LinearOperator, cg

CG_TOLERANCE = {("rtol" if "rtol" in signature(cg).parameters else "tol"): 1e-3}  # by the version of SciPy
SOFT_CELL = 0.02  # stiffness of the cells around the body, which only carry the motion on


class Grid:
    """Voxels whose axes are those of RAS."""

    def __init__(self, origin, spacing, shape):
        self.origin, self.spacing, self.shape = np.array(origin, float), float(spacing), tuple(int(n) for n in shape)

    def affine(self):
        out = np.diag([self.spacing] * 3 + [1.0])
        out[:3, 3] = self.origin
        return out

    def points(self):
        return np.moveaxis(np.indices(self.shape), 0, -1) * self.spacing + self.origin

    def sample(self, values, points, order=1, outside=0.0, mode="constant"):
        at = np.moveaxis((points - self.origin) / self.spacing, -1, 0)
        return ndimage.map_coordinates(values, at, order=order, cval=outside, mode=mode)

    def sees(self, points):
        at = (points - self.origin) / self.spacing
        return ((at >= 0) & (at <= np.array(self.shape) - 1)).all(-1)


def moved(motion, points):
    return points @ motion[:3, :3].T + motion[:3, 3]


def about(centre, rotation):
    out = np.eye(4)
    out[:3, :3] = rotation
    out[:3, 3] = centre - rotation @ centre
    return out


def cell_stiffness(poisson=0.45):
    """24 x 24 of a unit cube of Young's modulus 1, two Gauss points an axis."""
    lame, shear = poisson / ((1 + poisson) * (1 - 2 * poisson)), 1 / (2 * (1 + poisson))
    law = np.diag([2 * shear] * 3 + [shear] * 3)
    law[:3, :3] += lame
    corners = np.array([(i, j, k) for i in (0, 1) for j in (0, 1) for k in (0, 1)], float)
    out = np.zeros((24, 24))
    for gauss in (corners - 0.5) / np.sqrt(3) + 0.5:
        share = np.where(corners == 1, gauss, 1 - gauss)
        slope = np.stack([np.where(corners[:, a] == 1, 1, -1) * np.delete(share, a, 1).prod(1) for a in range(3)], 1)
        strain = np.zeros((6, 24))
        for n, (x, y, z) in enumerate(slope):
            strain[:, 3 * n:3 * n + 3] = [[x, 0, 0], [0, y, 0], [0, 0, z], [y, x, 0], [0, z, y], [z, 0, x]]
        out += strain.T @ law @ strain / 8
    return out


class Solid:
    """The template's tissue, and the motion of its cells' nodes in steps."""

    def __init__(self, grid, bones, stiffness, cell_mm, steps):
        """`bones`: label: mask; `stiffness` of every voxel, 0 in air."""
        self.cell_mm, self.steps = cell_mm, steps
        self.grid, self.bones = grid, bones
        self.away = {b: ndimage.distance_transform_edt(~mask) * grid.spacing for b, mask in bones.items()}
        near = ndimage.maximum_filter(stiffness, size=int(np.ceil(self.cell_mm / grid.spacing)) * 2 + 1)
        self.stiffness = np.where(stiffness > 0, stiffness, np.where(near > 0, SOFT_CELL, 0))
        margin = 6 * cell_mm
        extent = np.array(grid.shape) * grid.spacing + 2 * margin
        self.nodes = Grid(grid.origin - margin, cell_mm, np.ceil(extent / cell_mm))
        self.unit = cell_stiffness()
        self.corners = [tuple(slice(1, None) if far else slice(None, -1) for far in (i, j, k))
                        for i in (0, 1) for j in (0, 1) for k in (0, 1)]

    def back(self, points, fields):
        """Template points of points after the steps of `fields`."""
        for field in reversed(fields):
            start = points
            for _ in range(4):
                points = start - self.step_of(field, points)
        return points

    def step_of(self, field, points):
        return np.stack([self.nodes.sample(field[a], points, mode="nearest") for a in range(3)], -1)

    def field_of(self, fields, before, step):
        """Displacement of nodes in one step; `before`: bones' motions so far, `step`: those of this step."""
        nodes = self.nodes.points()
        centres = nodes[:-1, :-1, :-1] + self.cell_mm / 2
        stiffness = self.grid.sample(self.stiffness, self.back(centres, fields), order=0, mode="nearest")
        held, least = np.zeros(self.nodes.shape, int), np.full(self.nodes.shape, 0.8 * self.cell_mm)
        value = np.zeros((3, *self.nodes.shape))
        for b in self.bones:
            away = self.grid.sample(self.away[b], moved(np.linalg.inv(before[b]), nodes), mode="nearest")
            nearer = away < least
            held[nearer], least[nearer] = b, away[nearer]
            value[:, nearer] = (moved(step[b], nodes[nearer]) - nodes[nearer]).T
        fixed = (held > 0)[..., None]
        known = np.where(fixed, np.moveaxis(value, 0, -1), 0)
        used = np.zeros(held.shape, bool)
        for at in self.corners:
            used[at] |= stiffness > 0
        free = used[..., None] & ~fixed

        def forces(moves):
            """Of the cells' nodes, times the cells' stiffness."""
            out = np.zeros(moves.shape)
            of_cells = np.concatenate([moves[at] for at in self.corners], -1) @ self.unit * stiffness[..., None]
            for n, at in enumerate(self.corners):
                out[at] += of_cells[..., 3 * n:3 * n + 3]
            return out
        diagonal = np.zeros(held.shape)
        for at in self.corners:
            diagonal[at] += stiffness * self.unit[0, 0]
        shape = known.shape
        square = (known.size, known.size)
        operator = LinearOperator(
            square, lambda v: np.where(free, forces(np.where(free, v.reshape(shape), 0)), 0).ravel())
        jacobi = LinearOperator(square, lambda v: (v.reshape(shape) / np.maximum(diagonal, 1e-9)[..., None]).ravel())
        start = np.where(free, np.moveaxis(fields[-1], 0, -1), 0).ravel() if fields else None
        solved, _ = cg(operator, np.where(free, -forces(known), 0).ravel(), x0=start, M=jacobi, maxiter=4000, **CG_TOLERANCE)
        known += solved.reshape(shape)
        out = np.moveaxis(known, -1, 0)
        nearest = ndimage.distance_transform_edt(~(used | fixed[..., 0]), return_distances=False, return_indices=True)
        return out[:, nearest[0], nearest[1], nearest[2]]

    def fields_to(self, motions_at):
        """`motions_at(share)`: bones' motions from the template."""
        fields, before = [], motions_at(0.0)
        for n in range(self.steps):
            after = motions_at((n + 1) / self.steps)
            step = {b: after[b] @ np.linalg.inv(before[b]) for b in self.bones}
            fields.append(self.field_of(fields, before, step))
            before = after
        return fields

    def forward(self, points, fields):
        for field in fields:
            points = points + self.step_of(field, points)
        return points
