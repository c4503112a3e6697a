"""Fields, points and measures of the comparison. World: LPS mm, as ITK. Arrays are [k, j, i], fields [k, j, i, xyz]."""
import numpy as np
import SimpleITK as sitk
from scipy import ndimage


class Space:
    """Where the voxels of an image lie."""

    def __init__(self, image):
        self.origin = np.array(image.GetOrigin())
        self.matrix = np.array(image.GetDirection()).reshape(3, 3) @ np.diag(image.GetSpacing())
        self.size = np.array(image.GetSize())

    def to_voxels(self, mm):
        return (mm - self.origin) @ np.linalg.inv(self.matrix).T

    def places(self):
        k, j, i = np.meshgrid(*(np.arange(n) for n in self.size[::-1]), indexing="ij")
        return np.stack([i, j, k], -1) @ self.matrix.T + self.origin


def read(path):
    image = sitk.ReadImage(str(path))
    return image, sitk.GetArrayFromImage(image)


def resampled_labels(path, like):
    labels = sitk.Resample(sitk.ReadImage(str(path)), like, sitk.Transform(), sitk.sitkNearestNeighbor, 0)
    return sitk.GetArrayFromImage(labels)


def write(array, like, path):
    image = sitk.GetImageFromArray(array, isVector=array.ndim == 4)
    image.CopyInformation(like)
    sitk.WriteImage(image, str(path))


def sample(array, space, mm, outside=np.nan):
    """Trilinear at places in mm; `outside` beyond the voxel centres. Fields go on constant instead."""
    at = space.to_voxels(mm)[..., ::-1]
    axes = np.moveaxis(at, -1, 0)
    if array.ndim == 4:
        return np.stack([ndimage.map_coordinates(array[..., c], axes, order=1, mode="nearest") for c in range(3)], -1)
    out = ndimage.map_coordinates(array.astype(np.float32), axes, order=1, mode="nearest")
    inside = ((at > -1e-6) & (at < np.array(array.shape) - 1 + 1e-6)).all(-1)
    return np.where(inside, out, outside)


def warp(moving, moving_space, fixed_space, field, outside=np.nan):
    return sample(moving, moving_space, fixed_space.places() + field, outside)


def composed(first, second, space):
    """x -> second(first(x)), both displacement fields on `space`."""
    there = space.places() + first
    return first + sample(second, space, there)


def body_of(image):
    smooth = sitk.SmoothingRecursiveGaussian(sitk.Cast(image, sitk.sitkFloat32), max(image.GetSpacing()))
    mask = sitk.GetArrayFromImage(sitk.OtsuThreshold(smooth, 0, 1)) > 0
    return ndimage.binary_fill_holes(mask)


def dilated(mask, spacing_mm, by_mm):
    return ndimage.distance_transform_edt(~mask, sampling=spacing_mm[::-1]) <= by_mm


def folded_share(field, space, mask):
    slopes = np.stack([np.stack(np.gradient(field[..., c]), -1)[..., ::-1] for c in range(3)], -2)  # d u_c / d(i, j, k)
    jacobian = slopes @ np.linalg.inv(space.matrix) + np.eye(3)
    return float((np.linalg.det(jacobian)[mask] <= 0).mean())


def correlation(a, b, mask):
    use = mask & np.isfinite(b)
    return float(np.corrcoef(a[use], b[use])[0, 1])


def bending(field, places, labels):
    """Mean distance of bones' places from the rigid motion that fits each bone best, mm; 0 where bones stay rigid."""
    left = []
    for label in np.unique(labels[labels > 0]):
        start, end = places[labels == label], (places + field)[labels == label]
        a, b = start - start.mean(0), end - end.mean(0)
        u, _, vt = np.linalg.svd(a.T @ b)
        turn = vt.T @ np.diag([1, 1, np.sign(np.linalg.det(vt.T @ u.T))]) @ u.T
        left.append(np.linalg.norm(a @ turn.T - b, axis=1))
    return float(np.concatenate(left).mean())


def distances(field, space, truth):
    """MED over the truth points that both scans saw, mm: all, soft tissue, bone, 95th percentile."""
    flip = np.array([-1.0, -1.0, 1.0])  # the truth is in RAS
    start, end = truth["template"] * flip, truth["position"] * flip
    use = truth["in_fov"] & ~truth["hidden"]
    error = np.linalg.norm(start + sample(field, space, start) - end, axis=1)
    soft = truth["bone"] == 0
    return {"med": float(error[use].mean()), "soft": float(error[use & soft].mean()),
            "bone": float(error[use & ~soft].mean()), "p95": float(np.percentile(error[use], 95))}
