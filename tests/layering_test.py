#!/usr/bin/env python3
"""Checks every project include against the one-way doors between rooms (docs/architecture.md)."""
import re
import sys
from pathlib import Path

MAY_INCLUDE = {
    "core": {"core"},
    "kernels": {"core", "kernels"},
    "pipeline": {"core", "kernels", "pipeline"},
    "storage": {"core", "storage"},
    "api": {"core", "storage", "api"},
    "server": {"core", "kernels", "pipeline", "storage", "api", "server"},
    "cli": {"core", "kernels", "pipeline", "storage", "api", "server", "cli"},
    "tests": {"core", "kernels", "pipeline", "storage", "api", "server", "cli", "tests"},
}
# Slow or foreign headers that only one folder may see.
ONLY_IN = {r"itk\w*\.h": "pipeline/io/ tests/bench/itk_warp.cpp", r"dcmtk/.*": "pipeline/io/", r"httplib\.h": "server/ cli/ tests/", r"SQLiteCpp/.*": "storage/ tests/", r"CL/.*": "kernels/opencl.h", r"tbb/.*": "core/parallel.cpp",
           r"tiny_gltf\.h": "pipeline/io/ tests/", r"meshoptimizer\.h": "pipeline/surface/"}


def problems(root: Path):
    files = [f for room in MAY_INCLUDE for f in (root / room).rglob("*") if f.suffix in (".h", ".cpp")]
    if not files:
        yield "no sources found"
    for file in files:
        name = file.relative_to(root).as_posix()
        room = name.split("/")[0]
        for number, line in enumerate(file.read_text().splitlines(), 1):
            own = re.match(r'\s*#include "([^"]+)"', line)
            foreign = re.match(r"\s*#include <([^>]+)>", line)
            if own:
                target = own.group(1).split("/")[0]
                if target not in MAY_INCLUDE[room]:
                    yield f"{name}:{number}: {room} may not include {own.group(1)}"
                elif not (root / own.group(1)).exists():
                    yield f"{name}:{number}: write includes from the top of the repository: {own.group(1)}"
            if foreign:
                for pattern, where in ONLY_IN.items():
                    if re.fullmatch(pattern, foreign.group(1)) and not name.startswith(tuple(where.split())):
                        yield f"{name}:{number}: <{foreign.group(1)}> belongs in {where} only"


if __name__ == "__main__":
    found = list(problems(Path(sys.argv[1])))
    print("\n".join(found) or "every include goes through a door that is open to it")
    sys.exit(1 if found else 0)
