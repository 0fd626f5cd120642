#!/usr/bin/env python3
"""Draws a recording:  tools/plot_recording.py DIR OUT.svg
Force, torque, and CPU time over time. Red marks at the top are late ticks; gray bands are skipped ticks, which the
recording lacks. An example of how to read a recording: numpy.load suffices. The names of the columns are listed in
docs/recording.md."""
import json
import sys

if len(sys.argv) != 3:
    sys.exit(__doc__)
import numpy as np  # noqa: E402

folder, out = sys.argv[1:]
ticks = np.load(folder + "/ticks.npy")  # one row for each tick; ticks.dtype.names are the columns
recording = json.load(open(folder + "/recording.json", encoding="utf-8"))
scene = recording["scene"]["file"].rsplit("/", 1)[-1]


def seconds():
    """Time of each tick since the first, s, and the number of ticks skipped before it."""
    rate = np.full(len(ticks), float(recording["settings"]["rate"]))
    for change in recording["changes"]:
        if "rate" in change.get("settings", {}):
            rate[change["row"]:] = float(change["settings"]["rate"])
    step = np.diff(ticks["tick"].astype(np.int64), prepend=ticks["tick"][:1].astype(np.int64) - 1)
    skipped = np.maximum(step - 1, 0)  # a restart counts from 0 again
    # By the clock if one paced the ticks, otherwise in simulated time.
    period = np.where(ticks["period_us"] > 0, 1e-6 * ticks["period_us"], 1 / rate) + skipped / rate
    return np.cumsum(period) - period[:1], skipped


def vector(name, unit):
    return np.stack([ticks[f"{name}_{axis}_{unit}"] for axis in "xyz"], axis=1)


time, skipped = seconds()
late = np.flatnonzero(np.diff(ticks["overruns"].astype(np.int64)) > 0)  # a row counts the late ticks before it
curves = [
    ("force, N", np.linalg.norm(vector("force", "N"), axis=1), "#c0392b"),
    ("torque, mN·m", np.linalg.norm(vector("torque", "mNm"), axis=1), "#2471a3"),
    ("CPU time of the tick, µs", ticks["total_us"], "#7d6608"),
]

WIDTH, HEIGHT, LEFT, RIGHT, GAP = 900, 150, 60, 20, 40
BOTTOM = len(curves) * (HEIGHT + GAP)  # of the lowest plot
COLUMNS = WIDTH - LEFT - RIGHT
span = float(time[-1]) if len(time) > 1 else 1.0


def x(t):
    return LEFT + COLUMNS * t / span


def line(values, bottom, most, color):
    """Where ticks were skipped, the curve has a gap. Each pixel shows its greatest value, so that no peak is lost."""
    parts = []
    for rows in np.split(np.arange(len(ticks)), np.flatnonzero(skipped)):
        if not len(rows):
            continue
        pixels = np.minimum(COLUMNS * time[rows] / span, COLUMNS - 1).astype(int)
        pieces = np.split(rows, np.flatnonzero(np.diff(pixels)) + 1)
        top = [piece[np.argmax(values[piece])] for piece in pieces]
        points = " ".join(f"{x(time[row]):.1f},{bottom - HEIGHT * values[row] / most:.1f}" for row in top)
        parts.append(f'<polyline points="{points}" fill="none" stroke="{color}"/>')
    return parts


step = 10 ** np.floor(np.log10(span / 4))
step *= next(k for k in (1, 2, 5, 10) if span / (k * step) <= 8)
svg = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{BOTTOM + 50}" font-family="sans-serif" '
       f'font-size="12"><rect width="100%" height="100%" fill="white"/>'
       f'<text x="{LEFT}" y="18">{scene}: {len(ticks)} ticks in {span:.3g} s, {len(late)} late, {skipped.sum()} skipped</text>']
for row in np.flatnonzero(skipped):
    begin = x(time[row - 1] if row else 0)
    svg.append(f'<rect class="skipped" x="{begin:.1f}" y="{GAP}" width="{max(x(time[row]) - begin, 1):.1f}" height="{BOTTOM - GAP}" '
               f'fill="#ddd"/>')
for i, (title, values, color) in enumerate(curves):
    bottom = GAP + (i + 1) * HEIGHT + i * GAP
    values = np.nan_to_num(values)
    most = float(values.max(initial=0)) or 1.0
    for t in np.arange(0, span * (1 + 1e-9), step):
        svg.append(f'<path d="M{x(t):.1f},{bottom - HEIGHT}V{bottom}" stroke="#eee"/>'
                   f'<text class="time" x="{x(t):.1f}" y="{bottom + 15}" text-anchor="middle" fill="#666">{t:.6g} s</text>')
    svg.append(f'<path d="M{LEFT},{bottom - HEIGHT}V{bottom}H{WIDTH - RIGHT}" fill="none" stroke="#999"/>'
               f'<text x="{LEFT + 8}" y="{bottom - HEIGHT - 6}" fill="{color}">{title}</text>'
               f'<text x="{LEFT - 6}" y="{bottom - HEIGHT + 8}" text-anchor="end">{most:.3g}</text>'
               f'<text x="{LEFT - 6}" y="{bottom}" text-anchor="end">0</text>')
    svg += line(values, bottom, most, color)
    svg += [f'<path class="late" d="M{x(time[row]):.1f},{bottom - HEIGHT}v6" stroke="#e00"/>' for row in late]
svg.append("</svg>")
open(out, "w", encoding="utf-8").write("\n".join(svg))
