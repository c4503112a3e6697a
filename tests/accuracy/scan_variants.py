"""Variants of scans and of the files that they lie in."""
import nibabel
import numpy as np
from scipy import ndimage

from variant import TEMPLATE, reordered, variant

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


def read_as_unsigned(values, affine):
    return np.round(2 * values + 2.0 ** 15).astype(np.uint16), affine


@variant
def signed_read_as_unsigned(study):
    """Air at 32768."""
    study.change_all(read_as_unsigned)


@variant
def scans_signed_read_as_unsigned(study):
    study.change_scans(read_as_unsigned)


@variant
def scans_standardised(study):
    """Mean 0, spread 1, each by itself."""
    study.change_scans(lambda values, affine: (((values - values.mean()) / values.std()).astype(np.float32), affine))


@variant
def scans_brighter(study):
    """By 100, air and all."""
    study.change_scans(lambda values, affine: (values + 100.0, affine))


@variant
def scans_brighter_in_the_shadow_of_a_coil(study):
    study.change_scans(
        lambda values, affine: (values * np.geomspace(1.5, 0.67, values.shape[0])[:, None, None] + 100.0, affine))


@variant
def scans_clipped(study):
    """What is darker than muscle is as dark as that, and reads 0: a display's window."""
    study.change_scans(lambda values, affine: (np.clip(values, 60, 200) - 60, affine))


@variant
def scans_clipped_far_from_zero(study):
    study.change_scans(lambda values, affine: (np.clip(values, 40, 200), affine))


@variant
def saturated(study):
    """Whatever is brighter than half of the body has one value."""
    study.change_scans(lambda values, affine: (np.minimum(values, np.median(values[values > 60])), affine))


@variant
def later_echo(study):
    """Muscle nearly dark, fat as bright as before."""
    study.change_scans(lambda values, affine: (np.maximum(values, 0) ** 2 / np.percentile(values, 99.5), affine))


@variant
def earlier_echo(study):
    """Muscle nearly as bright as fat."""
    study.change_scans(lambda values, affine: (np.sqrt(np.maximum(values, 0) * np.percentile(values, 99.5)), affine))


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
