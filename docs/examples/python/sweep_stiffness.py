"""The same push with ten stiffnesses at once: how force and depth follow.  sweep_stiffness.py [FILE.csv]"""

import sys

import numpy as np

import touchstone as ts

scene = ts.Scene("bunnies")
stiffnesses = np.geomspace(0.05, 2, 10)
batch = ts.Batch(scene, len(stiffnesses), [scene.settings.with_(stiffness=k) for k in stiffnesses])
devices = scene.motions[0].poses(scene.settings["rate"])
poses, wrenches = batch.run(np.repeat(devices[:, None], len(stiffnesses), axis=1))

force = np.linalg.norm(wrenches[..., :3], axis=-1).max(axis=0)
lag = np.linalg.norm(poses[..., :3] - devices[:, None, :3], axis=-1).max(axis=0)
rows = np.stack([stiffnesses, force, lag], axis=-1)
header = "stiffness_N_per_mm,greatest_force_N,greatest_lag_mm"
if len(sys.argv) > 1:
    np.savetxt(sys.argv[1], rows, delimiter=",", header=header, comments="")
print(header)
for row in rows:
    print(",".join(f"{value:.3f}" for value in row))
