#!/usr/bin/env python3
"""Runs the commands of docs/api.md against a running service, as a reader would.

    api_walk.py URL FOLDER      FOLDER holds pose00.nii.gz, pose01.zip (or .nii.gz), bones_template.nii.gz, pose.json, in.csv

A line like `S=sub_…` takes the first such id of the last answer. Fails when a command fails or an answer is a problem,
apart from the lines after the build's: those wait for the job.
"""
import json
import re
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

PAGE = Path(__file__).resolve().parents[2] / "docs" / "api.md"


def blocks(text):
    return re.findall(r"^```\n(.*?)^```", text, re.S | re.M)


def wait_for(url, job):
    for _ in range(3600):
        with urllib.request.urlopen(f"{url}/v1/jobs/{job}") as answer:
            state = json.load(answer)
        if state["state"] not in ("queued", "running"):
            return state
        time.sleep(0.5)
    raise SystemExit("the job does not end")


def main():
    url, folder = sys.argv[1], sys.argv[2]
    variables, last, ran = {"U": url}, "", 0
    for block in blocks(PAGE.read_text()):
        for line in block.splitlines():
            assigned = re.findall(r"(\w)=((?:sub|mdl|job|scn|bon|bat|key)_)…", line)
            if assigned:
                for name, prefix in assigned:
                    found = re.search(prefix + r"[0-9a-z]{26}", last)
                    if not found:
                        raise SystemExit(f"no {prefix} id in {last[:300]}")
                    variables[name] = found.group(0)
                if "J" in variables and "M" in variables and not variables.get("built"):
                    state = wait_for(url, variables["J"])
                    variables["built"] = state["state"]
                    if state["state"] != "succeeded":
                        raise SystemExit(f"the build {state}")
                continue
            if line.startswith("U=") or not line.strip():
                continue
            if "$U/v1/jobs/$J" in line and "DELETE" in line:
                continue  # it has ended
            script = "".join(f"{name}='{value}'\n" for name, value in variables.items() if len(name) == 1) + line
            if "E=" in line:
                script += '\necho "E=$E"'
            done = subprocess.run(["bash", "-c", script], cwd=folder, capture_output=True, text=True, timeout=900)
            last = done.stdout or last
            kept = re.search(r"^E=(.*)$", done.stdout, re.M)
            if kept:
                variables["E"] = kept.group(1)
            if done.returncode != 0 or "urn:kinevox:problem" in done.stdout:
                raise SystemExit(f"{line}\n{done.stdout[:500]}{done.stderr[:500]}")
            ran += 1
            print(f"ok  {line[:110]}")
    print(f"{ran} commands")


if __name__ == "__main__":
    main()
