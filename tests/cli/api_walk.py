#!/usr/bin/env python3
"""Runs the fenced commands of docs/api.md against a running service, as a reader would: one bash from beginning to end.

    api_walk.py URL STUDY_FOLDER     the folder holds pose00 to pose02.nii.gz and bones.nii.gz, of two bones

`S=sub_…` takes the first such id of the last answer, `bat_…` elsewhere the newest one; `J=job_…` waits for that job. A zip of a
DICOM series becomes a NIfTI file, as the folder has none, and the one command that the end of a job makes senseless is left out.
"""
import json
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

PAGE = Path(__file__).resolve().parents[2] / "docs" / "api.md"
PRELUDE = r"""
set -euo pipefail
touch answers
curl() { command curl --silent --show-error --fail-with-body "$@" | tee last; cat last >>answers 2>/dev/null || true; echo; }
first() { grep -oE "$1_[0-9a-z]{26}" last | head -n 1; }
newest() { grep -oE "$1_[0-9a-z]{26}" answers | tail -n 1; }
ended() { ! command curl -fsS "$U/v1/jobs/$1" | grep -qE '"state":"(queued|running)"'; }
wait_for() { until ended "$1"; do sleep 0.2; done; command curl -fsS "$U/v1/jobs/$1" | grep -q '"state":"succeeded"'; }
wait_for_all() { while command curl -fsS "$U/v1/jobs" | grep -qE '"state":"(queued|running)"'; do sleep 0.2; done; }
"""


def commands():
    for block in re.findall(r"^```\n(.*?)^```", PAGE.read_text(), re.S | re.M):
        for line in block.splitlines():
            if line.startswith("U=") or "-X DELETE $U/v1/jobs/$J" in line:
                continue
            line = line.replace("pose01.zip", "pose01.nii.gz")
            for name, prefix in re.findall(r"(\w)=([a-z]{3})_…", line):
                yield f"{name}=$(first {prefix})" + (f"; wait_for ${name}" if prefix == "job" else "")
            if re.match(r"\w=[a-z]{3}_…", line):
                continue
            line = re.sub(r"([a-z]{3})_…", r"$(newest \1)", line)
            if "-X DELETE $U/v1/subjects" in line:
                yield "wait_for_all"
            if "-X DELETE $U/v1/batches" in line:  # 409: it has ended meanwhile
                line = line.split("#")[0].replace("curl", "command curl -sS -o last -w '%{http_code}'", 1)
                line += "| grep -qE '^(202|409)$'"
            yield line


def lay_out(study, folder):
    for name, file in {"pose00": "pose00", "pose01": "pose01", "pose02": "pose02", "pose03": "pose02", "pose04": "pose01",
                       "bones_template": "bones"}.items():
        shutil.copy(study / f"{file}.nii.gz", folder / f"{name}.nii.gz")
    (folder / "pose.json").write_text(json.dumps({"joints": {"tibia.flexion": 20}}))
    (folder / "in.csv").write_text("x,y,z,name\n1,2,3,here\n-4,5,6,there\n")


def main():
    url, study = sys.argv[1], Path(sys.argv[2])
    with tempfile.TemporaryDirectory() as folder:
        lay_out(study, Path(folder))
        script = PRELUDE + f"U={url}\nset -x\n" + "\n".join(commands()) + "\n"
        done = subprocess.run(["bash", "-c", script], cwd=folder, capture_output=True, timeout=900)
        sys.stdout.write((done.stdout + done.stderr).decode(errors="replace"))
        for name in ("bent.nii.gz", "posed.nrrd", "bent.png", "bent.glb", "bend.nii.gz", "out.csv"):
            if done.returncode == 0 and Path(folder, name).stat().st_size == 0:
                sys.exit(f"{name} is empty")
    sys.exit(done.returncode)


if __name__ == "__main__":
    main()
