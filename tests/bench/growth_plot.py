#!/usr/bin/env python3
"""Draws how a pose's CPU time grows, as an SVG, from Google Benchmark's JSON.

  kvx_bench --benchmark_filter=BM_Grow --benchmark_repetitions=5 --benchmark_format=json > growth.json
  growth_plot.py growth.json docs/pictures/posing-growth.svg

Of repetitions the fastest counts. Times and sizes are shares of the largest of each series; the dashed line is linear growth.
"""
import json
import sys

SERIES = [("BM_GrowVoxels", "voxels", "voxels, all else in proportion"), ("BM_GrowTissue", "tissue", "tissue in one grid"),
          ("BM_GrowExamples", "examples", "examples")]
WIDTH, HEIGHT, MARGIN, GAP = 300, 260, 46, 24


def fastest(benchmarks, name, size):
    least = {}
    for run in benchmarks:
        if run["name"].split("/")[0] == name and run.get("run_type") == "iteration":
            ms = run["cpu_time"] * {"ns": 1e-6, "us": 1e-3, "ms": 1, "s": 1e3}[run["time_unit"]]
            least[run[size]] = min(ms, least.get(run[size], ms))
    return sorted(least.items())


def panel(points, title, left):
    most_size, most_ms = points[-1][0], max(ms for _, ms in points)
    x = lambda size: left + MARGIN + (WIDTH - MARGIN) * size / most_size
    y = lambda ms: HEIGHT - MARGIN - (HEIGHT - 2 * MARGIN) * ms / (1.1 * most_ms)
    line = " ".join(f"{x(size):.1f},{y(ms):.1f}" for size, ms in points)
    parts = [f'<text x="{left + MARGIN}" y="20" font-weight="bold">{title}</text>',
             f'<path d="M{x(0):.1f} {y(1.1 * most_ms):.1f}V{y(0):.1f}H{x(most_size):.1f}" fill="none" stroke="#444"/>',
             f'<line x1="{x(0):.1f}" y1="{y(0):.1f}" x2="{x(most_size):.1f}" y2="{y(points[-1][1]):.1f}" stroke="#999" stroke-dasharray="5 4"/>',
             f'<polyline points="{line}" fill="none" stroke="#1667b7" stroke-width="2"/>']
    for size, ms in points:
        label = f"{size / 1e6:.2f} M" if size >= 1e5 else f"{size:g}"
        parts.append(f'<circle cx="{x(size):.1f}" cy="{y(ms):.1f}" r="3.5" fill="#1667b7"/>')
        parts.append(f'<text x="{x(size):.1f}" y="{y(ms) - 8:.1f}" text-anchor="middle">{ms:.0f}</text>')
        parts.append(f'<text x="{x(size):.1f}" y="{HEIGHT - MARGIN + 16}" text-anchor="middle" font-size="9">{label}</text>')
    parts.append(f'<text x="{left + 12}" y="{HEIGHT / 2}" transform="rotate(-90 {left + 12} {HEIGHT / 2})" text-anchor="middle">CPU ms</text>')
    return "\n".join(parts)


def main():
    with open(sys.argv[1]) as file:
        benchmarks = json.load(file)["benchmarks"]
    panels = [panel(fastest(benchmarks, name, size), title, n * (WIDTH + GAP)) for n, (name, size, title) in enumerate(SERIES)]
    width = len(SERIES) * (WIDTH + GAP) + 20
    with open(sys.argv[2], "w") as out:
        out.write(f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{HEIGHT}" viewBox="0 0 {width} {HEIGHT}" '
                  f'font-family="sans-serif" font-size="12">\n<rect width="100%" height="100%" fill="#fff"/>\n'
                  + "\n".join(panels) + "\n</svg>\n")


if __name__ == "__main__":
    main()
