#!/usr/bin/env python3
"""Checks that deploy/Containerfile installs the package of every shared library that the program names.

    image_packages_test.py ROOT PROGRAM
"""
import re
import subprocess
import sys
from pathlib import Path

IN_EVERY_IMAGE = {"libc6", "libgcc-s1", "libstdc++6"}  # of debian:12-slim
SKIPPED = 77


def output(*words):
    return subprocess.run(words, check=True, capture_output=True, text=True).stdout


def libraries(program):
    """File of every library that the program itself asks for, as the loader finds it."""
    needed = re.findall(r"NEEDED.*\[(.+)\]", output("readelf", "-d", program))
    found = dict(re.findall(r"(\S+) => (\S+)", output("ldd", program)))
    return [Path(found[name]).resolve() for name in needed]


def installed_in_image(root):
    text = (root / "deploy" / "Containerfile").read_text().split("FROM debian:12-slim")[1]
    return set(re.findall(r"[a-z0-9][a-z0-9.+-]+", text.split("--no-install-recommends")[1].split("&&")[0]))


def main():
    root, program = Path(sys.argv[1]), sys.argv[2]
    if not Path("/usr/bin/dpkg").exists():
        print("no Debian packages here to compare with")
        return SKIPPED
    missing = set()
    present = installed_in_image(root) | IN_EVERY_IMAGE
    for file in libraries(program):
        packages = {line.split(":")[0] for line in output("dpkg", "-S", f"*/{file.name}").splitlines()}
        if not packages & present:
            missing |= packages
    for package in sorted(missing):
        print(f"deploy/Containerfile does not install {package}, and the program needs it")
    return 1 if missing else 0


if __name__ == "__main__":
    sys.exit(main())
