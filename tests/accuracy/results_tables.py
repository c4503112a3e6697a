#!/usr/bin/env python3
"""Writes the tables of docs/results.md anew from what `kinevox evaluate MODEL --truth DIR --json` printed.

    results_tables.py docs/results.md "knee, half scale=knee-half.json" "hand, full scale=hand.json" "unseen:another knee=other.json"

What `unseen:` stands before has a row among the poses that were not scanned, and nowhere else. A section is replaced where the page has one of its title; other sections, and sentences below a table, stay. Distances are
millimetres, means over the training scans unless the table says otherwise.
"""
import json
import re
import sys
from pathlib import Path

STAGES = ("source", "initialise", "register")


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "| " + " | ".join("---" for _ in head) + " |"]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows])


def mean(values):
    values = [value for value in values if value is not None]
    return sum(values) / len(values) if values else None


def number(value, digits=2):
    return "–" if value is None else f"{value:.{digits}f}"


def by_stage(models):
    for name, found in models.items():
        for stage in STAGES:
            m = found["mean"][stage]
            yield [name if stage == "source" else "", stage, *(number(m[key]) for key in ("med", "soft", "joint", "p95")),
                   number(m["ssd"], 1), number(m["cc"]), number(m["mi"])]


def by_tissue(models):
    def of(found, stage, tissue):
        return mean([scan["distances"][stage]["by_tissue"].get(tissue) for scan in found["scans"]])

    tissues = sorted({t for found in models.values() for scan in found["scans"] for t in scan["distances"]["register"]["by_tissue"]})
    for tissue in tissues:
        cells = [[of(found, stage, tissue) for stage in STAGES] for found in models.values()]
        yield [tissue.replace("_", " "), *(f"{number(a, 1)} → {number(b)} → {number(c)}" for a, b, c in cells)]


def every_scan(models):
    for name, found in models.items():
        for scan in found["scans"]:
            bone, error = max(scan["bone_errors"].items(), key=lambda item: item[1]["rotation_deg"] + item[1]["translation_mm"])
            start, end = scan["distances"]["initialise"], scan["distances"]["register"]
            yield [name, scan["name"], f"{bone} {error['rotation_deg']:.2f}°, {error['translation_mm']:.2f} mm",
                   f"{start['med']:.2f}, {start['soft']:.2f}", f"{end['med']:.2f}, {end['soft']:.2f}",
                   f"{end['soft'] / start['soft']:.2f}", f"{end['p95'] / end['med']:.1f}",
                   f"{100 * scan['folded_fraction']:.3f} %", str(scan["control_points"])]


def unseen(models):
    for name, found in models.items():
        if not found["unseen"]:
            continue
        means = {mode: [mean([pose["distances"][mode][key] for pose in found["unseen"]]) for key in ("med", "soft", "joint")]
                 for mode in ("vbd", "evd")}
        ratios = [pose["distances"]["evd"]["soft"] / pose["distances"]["vbd"]["soft"] for pose in found["unseen"]]
        yield [name, *(", ".join(map(number, means[mode])) for mode in ("vbd", "evd")),
               f"{mean(ratios):.2f}, {min(ratios):.2f} to {max(ratios):.2f}"]


def seconds(models):
    for name, found in models.items():
        s = found["seconds"]
        bones = sum(s.get(stage, 0) for stage in ("register_bones", "refine_bones", "settle_bones"))
        yield [name, *(number(value, 1) for value in (bones, s["joints"] + s["weights"] + s["body"], s["register"], s["total"]))]


def sections(models, others):
    return {
        "Template to scan (the paper's Tables 3 and 4)":
            table(["data", "stage", "MED", "soft", "joint", "95 %", "SSD", "CC", "MI"], by_stage(models)),
        "By tissue": table(["tissue", *models], by_tissue(models)),
        "Every scan": table(["data", "scan", "worst bone", "MED, soft: initialise", "MED, soft: register", "soft ratio",
                             "95 % / MED", "folded", "control points"], every_scan(models)),
        "Poses that were not scanned": table(["data", "VBD (eq. 2)", "EVD (eq. 6)", "soft ratio: mean, range"],
                                             unseen(models | others)),
        "Seconds": table(["data", "bones of all scans", "body, joints, weights", "registration of all scans", "whole build"],
                         seconds(models)),
    }


def with_table(section, new_table):
    """The section with its first table replaced; rows that quote the paper stay."""
    old = re.search(r"(?m)^\|.*\n(?:\|.*\n?)+", section)
    quoted = "".join(f"\n{row}" for row in old.group(0).splitlines() if row.startswith("| the paper"))
    return section[:old.start()] + new_table + quoted + "\n" + section[old.end():]


def main():
    page = Path(sys.argv[1])
    models, others = {}, {}
    for argument in sys.argv[2:]:
        name, file = argument.removeprefix("unseen:").rsplit("=", 1)
        (others if argument.startswith("unseen:") else models)[name] = json.loads(Path(file).read_text())
    parts = re.split(r"(?m)^(?=## )", page.read_text())
    new = {f"## {title}": text for title, text in sections(models, others).items()}
    for i, part in enumerate(parts):
        title = part.split("\n", 1)[0]
        if title in new:
            parts[i] = with_table(part, new.pop(title))
    if new:
        sys.exit(f"{page} has no section {', '.join(new)}")
    page.write_text("".join(parts))


if __name__ == "__main__":
    main()
