#!/usr/bin/env python3
"""Checks what deploy/ and the lists of ignored files promise and no compiler reads.

    deployment_test.py ROOT
"""
import re
import shutil
import subprocess
import sys
from fnmatch import fnmatch
from pathlib import Path

PRIVATE = ("kinevox-data/kinevox.db", "deploy/tls/key.pem")  # patients' scans, the key of TLS
NOT_OF_THE_IMAGE = PRIVATE + ("tests/foreign/node_modules/a.js", "third_party/a", "build/bin/kinevox")
LARGEST_ANSWER = 12 * 10**9  # bytes: a field of three floats on the largest posed grid
SKIPPED = 77


def kept_from_image(root, file):
    """Whether .dockerignore names a file or a folder that it lies in; **/ stands for any depth."""
    places = [Path(file), *Path(file).parents]
    for pattern in (root / ".dockerignore").read_text().split():
        name = pattern.removeprefix("**/")
        if any(fnmatch(place.name if name != pattern else str(place), name) for place in places):
            return True
    return False


def faults(root):
    for file in NOT_OF_THE_IMAGE:
        if not kept_from_image(root, file):
            yield f".dockerignore lets {file} into the image"
    compose = (root / "deploy" / "compose.yaml").read_text()
    cache = re.search(r'"/var/cache/kinevox:([^"]*)"', compose)
    if "exec" not in cache.group(1).split(","):
        yield "deploy/compose.yaml: PoCL cannot load kernels from a cache that is not mounted exec"
    unit = (root / "deploy" / "kinevox.service").read_text()
    for kinds in ("char-nvidia* rw", "char-drm rw", "char-kfd rw"):  # nvidia, nvidia-frontend, nvidia-uvm
        if f"DeviceAllow={kinds}" not in unit:
            yield f"deploy/kinevox.service: nothing says how a GPU is let in by DeviceAllow={kinds}"
    newest = max(int(page.name[:4]) for page in (root / "docs" / "changes").glob("[0-9]*.md"))
    if f"VERSION 0.{newest}.0 " not in (root / "CMakeLists.txt").read_text():
        yield f"CMakeLists.txt: the version is not 0.{newest}.0, as the newest page of docs/changes says"
    pause = re.search(r"int pause_seconds = (\d+);", (root / "server/http/http_server.h").read_text()).group(1)
    for name in ("nginx.conf", "nginx-compose.conf"):
        site = (root / "deploy" / name).read_text()
        hosts = re.findall(r"proxy_set_header Host (\S+);", site)
        kept = re.search(r"proxy_max_temp_file_size (\d+)m;", site)
        if not kept or int(kept.group(1)) << 20 < LARGEST_ANSWER:
            yield f"deploy/{name}: a slow reader gets a part of a large answer"
        if set(re.findall(r"(?:client_body|send)_timeout (\d+)s;", site)) != {pause}:
            yield f"deploy/{name}: nginx waits for clients that pause as long as the service: {pause}s"
        if set(hosts) != {"$http_host"}:
            yield f"deploy/{name}: behind a port other than 443 the service's own page is of another origin"


def git_faults(root):
    for file in PRIVATE:
        if subprocess.run(["git", "-C", root, "check-ignore", "-q", file]).returncode != 0:
            yield f".gitignore lets {file} into a commit"


def main():
    root = Path(sys.argv[1])
    found = list(faults(root))
    has_git = shutil.which("git") is not None
    is_clone = has_git and subprocess.run(["git", "-C", root, "rev-parse"], capture_output=True).returncode == 0
    if is_clone:
        found += git_faults(root)
    for fault in found:
        print(fault)
    if found:
        return 1
    return 0 if is_clone else SKIPPED


if __name__ == "__main__":
    sys.exit(main())
