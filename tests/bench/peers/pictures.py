"""One picture of a pair: the template, and each tool's pulled-back scan over it (scan green, template magenta, alike grey)."""
import numpy as np
import SimpleITK as sitk

GAP, GREY, IN_A_ROW = 4, 0.4, 3


def windowed(array, low, high):
    return np.clip((np.nan_to_num(array) - low) / (high - low), 0, 1)


def planes(volume, body, spacing):
    """Slices through the body's middle along k, j, i with square pixels of the smallest spacing, as [row, column, rgb]."""
    middle = [int(round(c)) for c in np.array(np.nonzero(body)).mean(1)]
    fine = min(spacing)
    for axis in range(3):
        plane = np.take(volume, middle[axis], axis)
        rows, columns = (s for a, s in enumerate(spacing[::-1]) if a != axis)
        for side, step in ((0, rows), (1, columns)):
            at = np.arange(0, plane.shape[side], fine / step).astype(int)
            plane = np.take(plane, at, side)
        yield plane


def tile(volume, body, spacing):
    """The planes beside each other, in a frame."""
    shown = list(planes(volume, body, spacing))
    height = max(p.shape[0] for p in shown)
    framed = [np.pad(p, ((0, height - p.shape[0] + GAP), (0, GAP), (0, 0)), constant_values=GREY) for p in shown]
    return (255 * np.hstack(framed)).astype(np.uint8)


def sheet(template, body, spacing, warped):
    """Tiles from left to right: the template alone, then one for each image of `warped`. [row, column, rgb], uint8."""
    low, high = np.percentile(template, [1, 99.5])
    grey = windowed(template, low, high)
    overlays = [windowed(matched(image, template, body), low, high) for image in warped]
    tiles = [tile(np.stack([grey, green, grey], -1), body, spacing) for green in [grey, *overlays]]
    tiles += [np.full_like(tiles[0], int(255 * GREY))] * (-len(tiles) % IN_A_ROW)
    return np.vstack([np.hstack(tiles[at:at + IN_A_ROW]) for at in range(0, len(tiles), IN_A_ROW)])


def matched(image, template, body):
    """`image` with the template's mean and standard deviation within the body."""
    use = body & np.isfinite(image)
    gain = template[use].std() / max(image[use].std(), 1e-6)
    return template[use].mean() + gain * (image - image[use].mean())


def write(picture, path):
    sitk.WriteImage(sitk.GetImageFromArray(picture, isVector=True), str(path))
