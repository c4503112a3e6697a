"""Kinevox through its command line: a model of one pair, its maps as fields, and what the registration alone costs."""
import csv
import json
import shutil
from pathlib import Path

import numpy as np

from apart import timed


def study_of(folder, scan):
    """A study of the template and one scan, with absolute paths."""
    file = folder / "study.json"
    if file.exists():
        study = json.loads(file.read_text())
    else:
        manifest = json.loads((folder / "manifest.json").read_text())
        names = {b["label"]: b["name"] for b in manifest["bones"]}
        study = {"name": folder.name, "region": manifest["kind"], "template": "pose00",
                 "scans": [{"name": name, "volume": f"{name}.nii.gz"} for name in ("pose00", scan)],
                 "bones": {"labels": "bones_template.nii.gz",
                           "list": [{"label": b["label"], "name": b["name"], "parent": names.get(b["parent"])} for b in manifest["bones"]]}}
    study["scans"] = [{**s, "volume": str((folder / s["volume"]).resolve())} for s in study["scans"]
                      if s["name"] in (study["template"], scan)]
    study["bones"]["labels"] = str((folder / study["bones"]["labels"]).resolve())
    return study


class Model:
    def __init__(self, program, study, folder, options=()):
        self.program, self.folder = program, folder
        folder.parent.mkdir(parents=True, exist_ok=True)
        file, cost = folder.with_suffix(".study.json"), folder.with_suffix(".cost.json")
        file.write_text(json.dumps(study))
        self.build = [program, "build", file, "--out", folder, "--quiet", *options]
        if not cost.exists():  # an earlier run of this comparison may have built it
            shutil.rmtree(folder, ignore_errors=True)
            cost.write_text(json.dumps(timed(self.build)[1]))
        self.cost = json.loads(cost.read_text())

    def registration_cost(self):
        """Drops the registered correspondence, and builds it again: nothing else is made anew."""
        kept = self.folder.with_suffix(".registration.json")
        if kept.exists():
            return json.loads(kept.read_text())
        manifest = json.loads((self.folder / "model.json").read_text())
        for scan in manifest["scans"]:
            for file in (self.folder / "artifacts").rglob(scan["registered"] + "*"):
                file.unlink()
        kept.write_text(json.dumps(timed(self.build)[1]))
        return json.loads(kept.read_text())

    def map(self, scan, stage, places):
        kept = self.folder.with_suffix(f".{scan}.{stage}.npy")
        if kept.exists():
            return np.load(kept)
        source, target = self.folder.with_suffix(".in.csv"), self.folder.with_suffix(".out.csv")
        np.savetxt(source, places.reshape(-1, 3), fmt="%.4f", delimiter=",", header="x,y,z", comments="")
        timed([self.program, "map-points", self.folder, "--scan", scan, "--stage", stage, "--points", source, "--out", target])
        with open(target, newline="") as file:
            rows = csv.reader(file)
            next(rows)
            mapped = np.array([[float(v) for v in row[:3]] for row in rows])
        np.save(kept, mapped.reshape(places.shape).astype(np.float32))
        return np.load(kept)
