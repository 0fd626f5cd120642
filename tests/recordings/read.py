"""What numpy.load makes of a recording:  read.py DIR FIELDS CSV"""
import sys

import numpy as np

folder, fields, csv = sys.argv[1:]
ticks = np.load(folder + "/ticks.npy")
told = [[cell.strip(" `") for cell in line.split("|")[1:3]]
        for line in open(fields, encoding="utf-8").read().splitlines()[2:]]
assert ticks.shape == (2401,), ticks.shape
assert [[name, ticks.dtype[name].str[1:]] for name in ticks.dtype.names] == told, ticks.dtype
assert ticks.dtype.names[0] == "input_x_mm" and ticks.dtype["input_x_mm"] == np.dtype("<f8")
assert (ticks["tick"] == np.arange(2401)).all()
# A demonstration's poses are of unit length, so the tick takes them as they are, to rounding.
for axis in "xyz":
    assert np.allclose(ticks[f"input_{axis}_mm"], ticks[f"device_{axis}_mm"], rtol=0, atol=1e-9)
force = np.linalg.norm(np.stack([ticks[f"force_{axis}_N"] for axis in "xyz"]), axis=0)
assert 3 < force.max() < 20, force.max()
assert (ticks["input_stiffness_N_per_mm"] == 1).all()
table = np.genfromtxt(csv, delimiter=",", names=True, dtype=None, encoding="utf-8")
for name in ("input_y_mm", "force_y_N", "rows", "kkt_stationarity_N"):
    assert (table[name] == ticks[name]).all(), name
