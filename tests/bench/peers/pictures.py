"""One picture of a pair: the template, and each tool's pulled-back scan over it (scan green, template magenta, alike grey)."""
import numpy as np
import SimpleITK as sitk

GAP, GAP_GREY = 4, 96


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


def framed(plane, height, width):
    out = np.full((height + GAP, width + GAP, 3), GAP_GREY, np.uint8)
    out[:plane.shape[0], :plane.shape[1]] = (255 * plane).astype(np.uint8)
    return out


def sheet(template, body, spacing, warped):
    """Columns: the template alone, then one for each image of `warped`; rows: three planes. [row, column, rgb], uint8."""
    low, high = np.percentile(template, [1, 99.5])
    grey = windowed(template, low, high)
    volumes = [np.stack([grey] * 3, -1)]
    for image in warped:
        fitted = matched(image, template, body)
        volumes.append(np.stack([grey, windowed(fitted, low, high), grey], -1))
    columns = [list(planes(v, body, spacing)) for v in volumes]
    rows = [np.hstack([framed(p, *p.shape[:2]) for p in row]) for row in zip(*columns)]
    width = max(r.shape[1] for r in rows)
    return np.vstack([np.pad(r, ((0, 0), (0, width - r.shape[1]), (0, 0)), constant_values=GAP_GREY) for r in rows])


def matched(image, template, body):
    """`image` with the gain and offset that bring it closest to the template within the body."""
    use = body & np.isfinite(image)
    gain, offset = np.polyfit(image[use], template[use].astype(float), 1)
    return gain * image + offset


def write(picture, path):
    sitk.WriteImage(sitk.GetImageFromArray(picture, isVector=True), str(path))
