"""Pushes two bunnies against each other and plots what the hand feels:  plot_push.py push.png"""

import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import touchstone as ts

scene = ts.Scene("bunnies")
run = ts.run(scene)  # the demonstration, with the bits of `touchstone run bunnies --headless`
ticks = run.ticks
seconds = np.arange(len(ticks)) / scene.settings["rate"]
force = np.linalg.norm([ticks[f"force_{k}_N"] for k in "xyz"], axis=0)
torque = np.linalg.norm([ticks[f"torque_{k}_mNm"] for k in "xyz"], axis=0)

figure, (above, below) = plt.subplots(2, sharex=True, figsize=(8, 5))
above.plot(seconds, force)
above.set_ylabel("force, N")
below.plot(seconds, torque, color="tab:orange")
below.set_ylabel("torque, mN·m")
below.set_xlabel("time, s")
figure.savefig(sys.argv[1] if len(sys.argv) > 1 else "push.png", dpi=100)
print(f"{len(ticks)} ticks, greatest force {force.max():.2f} N, hash {run.report['hash']}")
