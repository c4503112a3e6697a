#!/usr/bin/env python3
"""Checks every project include against the one-way doors between rooms, and that there are no other rooms
(docs/architecture.md)."""
import re
import subprocess
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
# What else lies at the top of the repository; a study or model that somebody made there for a try does not.
BESIDE_THE_ROOMS = (
    "cmake deploy docs web CMakeLists.txt CMakePresets.json LICENSE NOTICE README.md do "
    ".ci .clang-format .clang-tidy .dockerignore .gitignore"
)
# The folders of the pipeline, lowest first: one may include those of lines above its own, and itself.
PIPELINE_LINES = (
    "io artifacts surface",
    "runner.h phantom pictures",
    "scans",
    "segmentation skinning",
    "bones",
    "skeleton measures",
    "examples",
    "posing",
    "registration",
    "model",
    "evaluate",
)
# The same inside of folders; "*" is what lies in such a folder itself, which is above all of its folders where no line
# says otherwise.
LINES = {
    "core": ("errors.h farthest_place.h frames.h name.h", "host text", "numbers", "*", "voxels"),
    "kernels": ("device", "*", "reference"),
    "storage": ("ids.h project_shares.h", "files", "database", "backup", "*"),
    "server": (
        "address.h http_library.h log.h metrics.h sweep_artifacts.h",
        "access turns",
        "ports seldom_log.h",
        "jobs",
        "http",
        "*",
    ),
    "cli": ("commands.h", "terminal", "options", "service", "*"),
    "pipeline": PIPELINE_LINES,
    "pipeline/io": ("atomic_file.h itk_image.h layered_labels.h volume_info.h voxel_values.h zip_file.h", "dicom", "*"),
    "pipeline/phantom": ("random.h trilinear.h", "anatomy", "motion", "*"),
    "pipeline/segmentation": ("cuts strokes names", "mr ct"),
    "pipeline/segmentation/mr": ("levels shells", "search"),
    "pipeline/bones": ("images bone_set", "template", "refine", "judge", "search"),
    "pipeline/model": ("files", "model.h scan_verdict.h", "warnings", "build"),
    "pipeline/registration": ("region", "images tissue paper", "blocks result"),
}
# Slow or foreign headers that only one folder may see.
ONLY_IN = {
    r"itk\w*\.h": "pipeline/io/ tests/bench/itk_warp.cpp",
    r"gdcm\w*\.h|dcmtk/.*": "pipeline/io/dicom/ tests/",
    r"(png|tiny_gltf)\.h": "pipeline/io/ tests/",
    r"httplib\.h": "server/ cli/ tests/",
    r"SQLiteCpp/.*": "storage/ tests/",
    r"archive\w*\.h": "storage/ pipeline/io/ tests/",
    r"zstd\.h": "storage/ pipeline/artifacts/ tests/",
    r"CL/.*": "kernels/device/opencl.h",
    r"CLI/.*|toml\+\+/.*": "cli/",
    r"cjose/.*": "server/ tests/support/",
    r"spdlog/.*": "server/log.cpp",
    r"tbb/.*": "core/host/parallel.cpp",
    r"nlopt\.h": "pipeline/registration/paper/",
    r"meshoptimizer\.h": "pipeline/surface/",
    r"(fstream|fcntl\.h|sys/stat\.h|unistd\.h)": "kernels/ pipeline/ storage/ api/ server/ cli/ tests/",  # not core
    r"openssl/.*": "core/digest.cpp core/text/base64.cpp api/handlers/resumable_uploads.cpp api/handlers/webhooks.cpp "
    "storage/ server/ tests/",
}
# Headers that hand JSON on; everything else that includes its slow header is a source.
JSON_HEADERS = (
    "api/request.h cli/service/asked_jobs.h cli/service/service_client.h cli/service/study_upload.h "
    "core/text/json_object.h "
    "pipeline/measures/measures_json.h pipeline/model/files/json_field.h pipeline/phantom/manifest.h tests/"
)


def passes_line(own: str, other: str) -> bool:
    """Whether a file may include another one of the same room, both given from the top of the repository."""
    a, b = own.split("/"), other.split("/")
    parting = next(n for n, (x, y) in enumerate(zip(a, b)) if x != y)
    lines = LINES.get("/".join(a[:parting]))
    if not lines or "." in a[parting] and "." in b[parting]:
        return True
    line_of = {name: line for line, names in enumerate(lines) for name in names.split()}
    files_line = line_of.get("*", len(lines))
    own_line = line_of.get(a[parting], files_line if "." in a[parting] else -1)
    return line_of.get(b[parting], files_line) < own_line


def strangers(root: Path):
    """Names at the top of what is committed, or about to be, that are no room of the house."""
    if not (root / ".git").exists():  # an unpacked archive has only what was committed
        return []
    command = ["git", "-c", "safe.directory=*", "-C", root, "ls-files"]  # whoever owns the checkout
    listed = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    return sorted({name.split("/")[0] for name in listed.splitlines()} - {*MAY_INCLUDE, *BESIDE_THE_ROOMS.split()})


def problems(root: Path):
    for name in strangers(root):
        yield f"{name}: no room and none of what lies beside them; see BESIDE_THE_ROOMS"
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
                elif room == target and not passes_line(name, own.group(1)):
                    yield f"{name}:{number}: {own.group(1)} does not lie below; see LINES"
                elif not (root / own.group(1)).exists():
                    yield f"{name}:{number}: write includes from the top of the repository: {own.group(1)}"
            if foreign:
                for pattern, where in ONLY_IN.items():
                    if re.fullmatch(pattern, foreign.group(1)) and not name.startswith(tuple(where.split())):
                        yield f"{name}:{number}: <{foreign.group(1)}> belongs in {where} only"
                if foreign.group(1) == "nlohmann/json.hpp" and file.suffix == ".h":
                    if not name.startswith(tuple(JSON_HEADERS.split())):
                        yield f"{name}:{number}: <nlohmann/json.hpp> belongs in sources; see JSON_HEADERS"


if __name__ == "__main__":
    found = list(problems(Path(sys.argv[1])))
    print("\n".join(found) or "every include goes through a door that is open to it")
    sys.exit(1 if found else 0)
