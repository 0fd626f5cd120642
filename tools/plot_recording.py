#!/usr/bin/env python3
"""Draws a recording:  tools/plot_recording.py DIR OUT.svg
Force, distance from tool to device, and CPU time over time. An example of how to read a recording: numpy.load suffices.
The names of the columns are listed in docs/recording.md."""
import json
import sys

import numpy as np

folder, out = sys.argv[1:]
ticks = np.load(folder + "/ticks.npy")  # one row for each tick; ticks.dtype.names are the columns
scene = json.load(open(folder + "/recording.json"))["scene"]["file"]


def vector(name, unit):
    return np.stack([ticks[f"{name}_{axis}_{unit}"] for axis in "xyz"], axis=1)


curves = [
    ("force, N", np.linalg.norm(vector("force", "N"), axis=1), "#c0392b"),
    ("distance from tool to device, mm", np.linalg.norm(vector("tool", "mm") - vector("device", "mm"), axis=1), "#2471a3"),
    ("CPU time of the tick, µs", ticks["total_us"], "#7d6608"),
]

WIDTH, HEIGHT, LEFT, GAP = 900, 150, 60, 40
svg = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{GAP + len(curves) * (HEIGHT + GAP)}" '
       f'font-family="sans-serif" font-size="12"><rect width="100%" height="100%" fill="white"/>'
       f'<text x="{LEFT}" y="18">{scene.rsplit("/", 1)[-1]}, {len(ticks)} ticks</text>']
for i, (title, values, color) in enumerate(curves):
    bottom = GAP + (i + 1) * HEIGHT + i * GAP
    most = float(values.max(initial=0)) or 1.0
    # One piece for each pixel, drawn at its greatest value, so that no peak is lost.
    pieces = np.array_split(values, min(len(values), WIDTH - LEFT - 20) or 1)
    points = " ".join(f"{LEFT + j * (WIDTH - LEFT - 20) / len(pieces):.1f},"
                      f"{bottom - HEIGHT * p.max(initial=0) / most:.1f}" for j, p in enumerate(pieces))
    svg.append(f'<path d="M{LEFT},{bottom - HEIGHT}V{bottom}H{WIDTH - 20}" fill="none" stroke="#999"/>'
               f'<text x="{LEFT + 8}" y="{bottom - HEIGHT + 4}" fill="{color}">{title}</text>'
               f'<text x="{LEFT - 6}" y="{bottom - HEIGHT + 8}" text-anchor="end">{most:.3g}</text>'
               f'<text x="{LEFT - 6}" y="{bottom}" text-anchor="end">0</text>'
               f'<polyline points="{points}" fill="none" stroke="{color}"/>')
svg.append(f'<text x="{WIDTH - 20}" y="{GAP + len(curves) * (HEIGHT + GAP) - 20}" text-anchor="end">'
           f'{len(ticks)} ticks</text></svg>')
open(out, "w", encoding="utf-8").write("\n".join(svg))
