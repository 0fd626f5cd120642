"""Checks that a drawing of a recording places its ticks in time:  plot.py DIR PLOT_RECORDING WORK
The recording is one of 2401 ticks at 1 kHz in simulated time. Here the clock paces it, one tick is late by half a second, and
200 ticks are missing."""
import re
import shutil
import subprocess
import sys

import numpy as np

folder, script, work = sys.argv[1:]
shutil.copytree(folder, work)
ticks = np.load(folder + "/ticks.npy")
ticks["period_us"] = 1000
ticks["period_us"][501] = 501_000  # after the late tick 500
ticks["overruns"][501:] = 1
np.save(work + "/ticks.npy", np.delete(ticks, np.arange(1000, 1200)))
subprocess.run([sys.executable, script, work, work + "/plot.svg"], check=True)
svg = open(work + "/plot.svg", encoding="utf-8").read()
assert "2201 ticks in 2.9 s, 1 late, 200 skipped" in svg, svg[:600]

labels = [(float(x), float(t)) for x, t in re.findall(r'<text class="time" x="([\d.]+)"[^>]*>([\d.]+) s<', svg)]
left, scale = labels[0][0], (labels[1][0] - labels[0][0]) / (labels[1][1] - labels[0][1])
assert labels[0][1] == 0


def seconds(x):
    return (float(x) - left) / scale


late = {seconds(x) for x in re.findall(r'class="late" d="M([\d.]+)', svg)}
assert len(late) == 1 and abs(late.pop() - 0.5) < 0.002, late
(begin, width), = re.findall(r'class="skipped" x="([\d.]+)"[^>]*?width="([\d.]+)"', svg)
assert abs(seconds(begin) - 1.499) < 0.002 and abs(float(width) / scale - 0.201) < 0.002, (begin, width)
lines = re.findall(r'<polyline points="([^"]*)"', svg)
assert len(lines) == 6, len(lines)  # two pieces of three curves
ends = [[seconds(point.split(",")[0]) for point in (line.split()[0], line.split()[-1])] for line in lines[:2]]
assert np.allclose(ends, [[0, 1.499], [1.7, 2.9]], atol=0.005), ends
