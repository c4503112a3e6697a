#!/usr/bin/env python3
"""Checks how long files and functions are: what is longer is split. Of a function the lines of tables do not count."""
import re
import sys
from pathlib import Path

ROOMS = ("core", "kernels", "pipeline", "storage", "api", "server", "cli", "tests")
MOST_LINES = {".cpp": 400, ".h": 150, ".cl": 150, ".py": 400}
MOST_IN_FUNCTION = 40  # between its braces
# Longer, because a part would say nothing by itself.
LONGER = {
    "kernels/cl/block_equations.cl": 165,
    "kernels/cl/evd_newton.cl.h": 155,
    "kernels/cl/evd_pull.cl": 165,
    "kernels/cl/evd_pull.cl.h": 165,
}
LITERALS = re.compile(r'R"\((?:.|\n)*?\)"|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])\'|//[^\n]*')
OPENS_CODE = re.compile(r"(\)|\]|\b(else|do|try|const|noexcept|override|mutable|[^=]-> [\w:<>&* ]+))\s*$")
OPENS_SCOPE = re.compile(r"\b(namespace|struct|class|enum|union|extern)\b[^;(){}]*(\([^()]*\)[^;(){}]*)?$")


def blocks(text: str):
    """Of everything between braces: its kind, first and last line, and how many braces of functions hold it."""
    text = LITERALS.sub(lambda m: "\n" * m.group().count("\n") + "0", text)
    line, open_blocks, since = 1, [], 0
    for at, sign in enumerate(text):
        line += sign == "\n"
        if sign == "{":
            before = text[since:at]
            code = not before.strip() or OPENS_CODE.search(before)
            kind = "scope" if OPENS_SCOPE.search(before) else "code" if code else "table"
            open_blocks.append((kind, line, sum(k == "code" for k, *_ in open_blocks)))
        if sign == "}" and open_blocks:
            kind, first, depth = open_blocks.pop()
            yield kind, first, line, depth
        if sign in ";{}":
            since = at + 1


def long_functions(text: str):
    found = list(blocks(text))
    in_tables = {n for kind, first, last, _ in found if kind == "table" for n in range(first + 1, last)}
    for kind, first, last, depth in found:
        if kind == "code" and depth == 0:
            lines = sum(n not in in_tables for n in range(first + 1, last))
            if lines > MOST_IN_FUNCTION:
                yield first, lines


def problems(root: Path):
    files = [f for room in ROOMS for f in sorted((root / room).rglob("*")) if f.suffix in MOST_LINES]
    if not files:
        yield "no sources found"
    for file in files:
        name, text = file.relative_to(root).as_posix(), file.read_text()
        most = LONGER.get(name, MOST_LINES[file.suffix])
        if text.count("\n") > most:
            yield f"{name}: {text.count(chr(10))} lines, of {most} at most"
        if file.suffix in (".h", ".cpp"):
            for line, lines in long_functions(text):
                yield f"{name}:{line}: a function of {lines} lines, of {MOST_IN_FUNCTION} at most"


if __name__ == "__main__":
    found = list(problems(Path(sys.argv[1])))
    print("\n".join(found) or "every file and every function is short enough")
    sys.exit(1 if found else 0)
