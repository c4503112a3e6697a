"""Every tool on every pair, started from nothing and from Kinevox's VBD: MED, CC, folds, seconds, memory.

Direction of all fields: template to scan. From VBD, a tool registers the template to the scan pulled back through VBD, and
its field is put behind VBD. Each tool's field is checked: it must reproduce the image that the tool itself has warped.
"""
import argparse
import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np

import geometry as geo
import pictures
from apart import timed
from kinevox import Model, study_of
from tools import TOOLS

HERE = Path(__file__).parent
COLUMNS = ("pair", "start", "tool", "MED", "soft", "bone", "95 %", "bent bone", "CC", "folded %", "CPU s", "wall s", "MiB", "field error %")


class Pair:
    def __init__(self, program, folder, scan, work):
        self.folder, self.scan = folder, scan
        self.name, self.work = f"{folder.name} {scan}", work / f"{folder.name}-{scan}"
        study = study_of(folder, scan)
        volumes = {s["name"]: s["volume"] for s in study["scans"]}
        self.fixed_file, self.moving_file = volumes[study["template"]], volumes[scan]
        self.fixed_image, self.fixed = geo.read(self.fixed_file)
        self.moving_image, self.moving = geo.read(self.moving_file)
        self.space, self.moving_space = geo.Space(self.fixed_image), geo.Space(self.moving_image)
        self.body = geo.body_of(self.fixed_image)
        self.region = geo.dilated(self.body, self.fixed_image.GetSpacing(), 3.0)
        points = folder / "truth" / f"{scan}_points.npz"
        self.truth = np.load(points) if points.exists() else None
        self.shown = []  # (what, the scan pulled back), for the picture
        self.labels = geo.resampled_labels(study["bones"]["labels"], self.fixed_image)
        self.model = Model(program, study, self.work / "model")
        places = self.space.places()
        self.vbd = (self.model.map(scan, "initialise", places) - places).astype(np.float32)
        self.ours = (self.model.map(scan, "register", places) - places).astype(np.float32)

    def pulled_back(self):
        """The scan through VBD on the template's grid, and where it shows something."""
        image = geo.warp(self.moving, self.moving_space, self.space, self.vbd)
        seen = np.isfinite(image) & self.region
        files = self.work / "pulled.nii.gz", self.work / "seen.nii.gz"
        geo.write(np.nan_to_num(image).astype(np.float32), self.fixed_image, files[0])
        geo.write(seen.astype(np.uint8), self.fixed_image, files[1])
        return files

    def row(self, start, tool, field, cost=None, check=None):
        warped = geo.warp(self.moving, self.moving_space, self.space, field)
        self.shown.append((f"{tool}, {start}", warped))
        out = {"pair": self.name, "start": start, "tool": tool,
               "bent bone": geo.bending(field, self.space.places(), self.labels),
               "CC": geo.correlation(self.fixed, warped, self.region),
               "folded %": 100 * geo.folded_share(field, self.space, self.body), "field error %": check}
        if self.truth is not None:
            d = geo.distances(field, self.space, self.truth)
            out |= {"MED": d["med"], "soft": d["soft"], "bone": d["bone"], "95 %": d["p95"]}
        if cost:
            out |= {"CPU s": cost["cpu_s"], "wall s": cost["wall_s"], "MiB": cost["memory_mib"]}
        return out

    def write_picture(self, path):
        pictures.write(pictures.sheet(self.fixed, self.body, self.fixed_image.GetSpacing(), [w for _, w in self.shown]), path)
        print(f"{path}: template; " + "; ".join(what for what, _ in self.shown), flush=True)


def field_error(tool_warped, moving, moving_space, fixed_space, field):
    """Mean difference between the tool's own warped image and ours through its field, in per cent of the range."""
    ours = geo.warp(moving, moving_space, fixed_space, field)
    use = np.isfinite(ours)
    return float(100 * np.abs(ours - tool_warped)[use].mean() / np.ptp(moving))


def run_peer(tool, start, pair, limit_s):
    out = pair.work / f"{tool}-{start}"
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    moving, mask = (pair.moving_file, None) if start == "nothing" else map(str, pair.pulled_back())
    job = {"fixed": pair.fixed_file, "moving": moving, "mask": mask, "out": str(out), "deformable_only": start == "vbd"}
    (out / "job.json").write_text(json.dumps(job))
    with open(out / "log.txt", "w") as log:
        timed([sys.executable, HERE / "tools.py", tool, out / "job.json"], limit_s, log, cwd=out)
    field = geo.read(out / "field.nii.gz")[1].astype(np.float32).reshape(*pair.fixed.shape, 3)
    moving_image, moving_array = geo.read(moving)
    check = field_error(geo.read(out / "warped.nii.gz")[1], moving_array, geo.Space(moving_image), pair.space, field)
    if start == "vbd":
        field = geo.composed(field, pair.vbd, pair.space)
    return pair.row(start, tool, field, json.loads((out / "cost.json").read_text()), check)


def rows_of(pair, tools, starts, limit_s):
    yield pair.row("-", "unregistered", np.zeros_like(pair.vbd))
    yield pair.row("-", "Kinevox VBD", pair.vbd)
    yield pair.row("bones alone", "Kinevox, all stages", pair.ours, pair.model.cost)
    yield pair.row("vbd", "Kinevox, registration", pair.ours, pair.model.registration_cost())
    for start in starts:
        for tool in tools:
            try:
                yield run_peer(tool, start, pair, limit_s)
            except (subprocess.SubprocessError, RuntimeError, OSError) as error:
                yield {"pair": pair.name, "start": start, "tool": f"{tool}: no result ({type(error).__name__})"}


def shown(value):
    if value is None or (isinstance(value, float) and not np.isfinite(value)):
        return "–"
    return f"{value:.2f}" if isinstance(value, float) else str(value)


def table(rows):
    lines = ["| " + " | ".join(COLUMNS) + " |", "|" + " --- |" * len(COLUMNS)]
    return "\n".join(lines + ["| " + " | ".join(shown(r.get(c)) for c in COLUMNS) + " |" for r in rows])


def default_pairs(program, work):
    for kind, scan in (("knee", "pose02"), ("hand", "pose02")):
        folder = work / f"{kind}-phantom"
        if not (folder / "manifest.json").exists():
            timed([program, "phantom", kind, "--out", folder, "--seed", "5", "--scale", "half"])
        yield folder, scan


def main():
    a = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    a.add_argument("--work", required=True, type=Path, help="folder for everything that is made")
    a.add_argument("--kinevox", type=Path, default=HERE.parents[2] / "build/bin/kinevox")
    a.add_argument("--pair", action="append", help="FOLDER:SCAN, a study or a phantom; default: half-scale phantoms are made")
    a.add_argument("--tools", type=lambda s: s.split(","), default=list(TOOLS))
    a.add_argument("--start", type=lambda s: s.split(","), default=["nothing", "vbd"])
    a.add_argument("--limit", type=float, default=1800, help="seconds for one registration by a peer")
    a = a.parse_args()
    if unknown := sorted(set(a.tools) - set(TOOLS)):
        raise SystemExit(f"no such tool: {', '.join(unknown)}; there are {', '.join(TOOLS)}")
    a.work.mkdir(parents=True, exist_ok=True)
    work = a.work.resolve()
    if a.pair:
        pairs = [(Path(p.rsplit(":", 1)[0]).resolve(), p.rsplit(":", 1)[1]) for p in a.pair]
    else:
        pairs = list(default_pairs(a.kinevox, work))
    rows = []
    for folder, scan in pairs:
        pair = Pair(a.kinevox, folder, scan, work)
        for row in rows_of(pair, a.tools, a.start, a.limit):
            rows.append(row)
            print(" | ".join(shown(row.get(c)) for c in COLUMNS), flush=True)
            (work / "peers.json").write_text(json.dumps(rows, indent=1))
        pair.write_picture(pair.work.with_suffix(".png"))
    (work / "peers.md").write_text(table(rows) + "\n")
    print(table(rows))


if __name__ == "__main__":
    main()
