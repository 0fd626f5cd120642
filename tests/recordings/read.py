"""Checks what numpy.load reads from a recording:  read.py DIR FIELDS CSV"""
import sys

import numpy as np

folder, fields_file, csv = sys.argv[1:]
ticks = np.load(folder + "/ticks.npy")
stored, derived = (table.splitlines()[2:] for table in open(fields_file, encoding="utf-8").read().split("\n\n"))
schema = []   # a row names one column or the components of a vector
for line in stored:
    names, kind = line.split("|")[1:3]
    schema += [[name.strip(" `"), kind.strip()] for name in names.split(",")]
derived_names = {line.split("`")[1] for line in derived}
assert ticks.shape == (2401,), ticks.shape
assert [[name, ticks.dtype[name].str[1:]] for name in ticks.dtype.names] == schema, ticks.dtype
assert not derived_names & set(ticks.dtype.names)
assert ticks.dtype.names[0] == "input_x_mm" and ticks.dtype["input_x_mm"] == np.dtype("<f8")
assert (ticks["tick"] == np.arange(2401)).all()
# The quaternions of a demonstration have unit length, so the tick uses its poses unchanged, up to rounding.
for axis in "xyz":
    assert np.allclose(ticks[f"input_{axis}_mm"], ticks[f"device_{axis}_mm"], rtol=0, atol=1e-9)
force = np.linalg.norm(np.stack([ticks[f"force_{axis}_N"] for axis in "xyz"]), axis=0)
assert 3 < force.max() < 20, force.max()
assert (ticks["input_stiffness_N_per_mm"] == 1).all()
table = np.genfromtxt(csv, delimiter=",", names=True, dtype=None, encoding="utf-8")
for name in ("input_y_mm", "force_y_N", "rows", "kkt_stationarity_N"):
    assert (table[name] == ticks[name]).all(), name
