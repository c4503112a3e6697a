"""How the registration bears another scanner: one pair of a phantom, its scan changed in several ways, MED before and after.

  robustness.py --kinevox PROGRAM --dataset PHANTOM --scan pose02 --work DIR [--only "snr8,thick slices"]

Runs in the environment of run.sh. Each variant is a study of its own with the phantom's truth; `kinevox evaluate` scores it.
With a part of the scan cut away, only truth points that it still shows count.
"""
import argparse
import json
import shutil
from pathlib import Path

import numpy as np

import geometry as geo
from kinevox import study_of, timed


def brighter(scan, _):
    return 1.3 * scan


def darker(scan, _):
    return 0.7 * scan


def snr8(scan, random):
    """Rician noise of an eighth of the bright tissue's level."""
    return rician(scan, bright(scan) / 8, random)


def bright(scan):
    """The level of bright tissue, however much air is in view."""
    return np.percentile(scan[scan > scan.mean()], 75)


def rician(scan, sigma, random):
    return np.hypot(scan + sigma * random.standard_normal(scan.shape), sigma * random.standard_normal(scan.shape))


def bias(scan, _):
    """A smooth field from 0.5 to 2 across the volume, bent along the other axes."""
    k, j, i = (np.linspace(-1, 1, n) for n in scan.shape)
    return scan * np.exp(np.log(2) * np.clip(j[None, :, None] * 0.8 + 0.4 * np.sin(3 * i)[None, None, :] * k[:, None, None], -1, 1))


def coil(scan, _):
    """A coil at one side: a quarter of the brightness at the other."""
    return scan * np.power(4.0, -np.linspace(0, 1, scan.shape[2]))[None, None, :]


def other_scanner(scan, random):
    """Darker, shaded mildly, noisier; its voxels are made wider and thicker, too."""
    shaded = 0.6 * scan * np.power(1.3, np.linspace(-1, 1, scan.shape[1]))[None, :, None]
    return rician(shaded, bright(shaded) / 15, random)


def same(scan, _):
    return scan


def inverted(scan, _):
    """Bright becomes dark inside the body: air stays air, as in another sequence."""
    top = np.percentile(scan, 99.5)
    body = scan > 0.15 * top
    return np.where(body, np.clip(1.2 * top - scan, 0.2 * top, None), scan)


def other_contrast(scan, _):
    """A curve that is not monotonic: middle grey brightest."""
    top = np.percentile(scan, 99.5)
    x = np.clip(scan / top, 0, 1)
    return 255 * (0.15 * x + 4 * x * (1 - x) * 0.8)


VARIANTS = {"as it is": same, "+30 %": brighter, "-30 %": darker, "snr8": snr8, "bias": bias, "coil": coil,
            "half the view": same, "half lengthwise": same, "thick slices": same, "three slices made one": same, "wide voxels": same, "other scanner": other_scanner, "inverted": inverted, "other contrast": other_contrast}


def halved(image, nth):
    """The first half along the nth longest axis of the view."""
    lengths = np.array(image.GetSize()) * image.GetSpacing()
    axis = int(np.argsort(-lengths, kind="stable")[nth])
    size = list(image.GetSize())
    size[axis] //= 2
    return geo.sitk.RegionOfInterest(image, size, [0, 0, 0])


def thick_slices(image):
    """Means over slices, 4 mm and more."""
    return geo.sitk.BinShrink(image, [1, 1, int(np.ceil(4 / image.GetSpacing()[2]))])


def wider_voxels(image):
    """A quarter wider in the plane, as smooth as they are wide, and thick slices."""
    sigma = [0.4 * s for s in image.GetSpacing()[:2]] + [1e-3]
    spacing = [1.25 * s for s in image.GetSpacing()[:2]] + [image.GetSpacing()[2]]
    size = [int(n * s / t) for n, s, t in zip(image.GetSize(), image.GetSpacing(), spacing)]
    smooth = geo.sitk.DiscreteGaussian(image, [s * s for s in sigma])
    return thick_slices(geo.sitk.Resample(smooth, size, geo.sitk.Transform(), geo.sitk.sitkLinear, image.GetOrigin(),
                                          spacing, image.GetDirection(), 0.0, image.GetPixelID()))


RESHAPED = {"half the view": lambda image: halved(image, 0), "half lengthwise": lambda image: halved(image, 1),
            "thick slices": thick_slices, "three slices made one": lambda image: geo.sitk.BinShrink(image, [1, 1, 3]),
            "wide voxels": lambda image: geo.sitk.BinShrink(image, [2, 2, 2]), "other scanner": wider_voxels}


def write_variant(name, dataset, scan, folder):
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "truth").mkdir(parents=True)
    shutil.copy(dataset / "manifest.json", folder)
    study = study_of(dataset, scan)
    entry = next(s for s in study["scans"] if s["name"] == scan)
    image, values = geo.read(entry["volume"])
    changed = VARIANTS[name](values.astype(np.float32), np.random.default_rng(7)).astype(np.float32)
    truth = dict(np.load(dataset / "truth" / f"{scan}_points.npz"))
    entry["volume"] = str(folder / f"{scan}.nii.gz")
    geo.write(changed, image, entry["volume"])
    seen = RESHAPED.get(name, lambda image: image)(geo.sitk.ReadImage(entry["volume"]))
    geo.sitk.WriteImage(seen, entry["volume"])
    at = geo.Space(seen).to_voxels(truth["position"] * [-1, -1, 1])
    truth["in_fov"] = truth["in_fov"] & ((at >= 0) & (at <= np.array(seen.GetSize()) - 1)).all(1)
    np.savez(folder / "truth" / f"{scan}_points.npz", **truth)
    manifest = json.loads((folder / "manifest.json").read_text())
    manifest["poses"] = [p for p in manifest["poses"] if p["file"].startswith(scan)]
    (folder / "manifest.json").write_text(json.dumps(manifest))
    (folder / "study.json").write_text(json.dumps(study))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kinevox", required=True, type=Path)
    parser.add_argument("--dataset", required=True, type=Path)
    parser.add_argument("--scan", default="pose02")
    parser.add_argument("--work", required=True, type=Path)
    parser.add_argument("--only", type=lambda s: s.split(","), default=list(VARIANTS), help="of: " + ", ".join(VARIANTS).replace("%", "%%"))
    a = parser.parse_args()
    for name in a.only:
        if name not in VARIANTS:
            parser.error(f"no variant '{name}'; there are: {', '.join(VARIANTS)}")
    print("| scan | worst bone (deg, mm) | soft MED: initialise | register | 95 %: initialise | register | CC: initialise | register | folded % |")
    print("|" + " --- |" * 9, flush=True)
    for name in a.only:
        folder = a.work.resolve() / name.replace(" ", "-").replace("%", "pc")
        write_variant(name, a.dataset.resolve(), a.scan, folder)
        model = folder / "model"
        timed([a.kinevox, "build", folder / "study.json", "--out", model, "--artifacts", a.work.resolve() / "artifacts", "--quiet"])
        out, _ = timed([a.kinevox, "evaluate", model, "--truth", folder, "--json", "--quiet"])
        scan = json.loads(out)["scans"][0]
        worst = max(scan["bone_errors"].items(), key=lambda b: b[1]["translation_mm"])
        before, after = scan["distances"]["initialise"], scan["distances"]["register"]
        cc = [scan["measures"][s]["cc"] for s in ("initialise", "register")]
        print(f"| {name} | {worst[0]} {worst[1]['rotation_deg']:.2f}, {worst[1]['translation_mm']:.2f} | {before['soft']:.2f} | "
              f"{after['soft']:.2f} | {before['p95']:.2f} | {after['p95']:.2f} | {cc[0]:.2f} | {cc[1]:.2f} | "
              f"{100 * scan['folded_fraction']:.3f} |", flush=True)


if __name__ == "__main__":
    main()
