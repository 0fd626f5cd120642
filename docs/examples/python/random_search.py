"""Inserts a peg by trying places at random while pressing, without knowing where the hole is:  random_search.py [SEED]"""

import sys
import tempfile
from pathlib import Path

import numpy as np

import peg_parts
import touchstone as ts

seed = int(sys.argv[1]) if len(sys.argv) > 1 else 1
with tempfile.TemporaryDirectory() as folder:
    task = ts.Insertion(
        peg_parts.write(Path(folder) / "peg.glb"), start_error_mm=1.5, goal_error_mm=1.0, step_mm=0.5, max_actions=3000
    )
    random = np.random.default_rng(seed)
    observation, _ = task.reset(seed=seed)
    target = observation["goal"][[0, 2]]
    over = seated = False
    actions = 0
    while not over:
        x, y, z = observation["pose"][:3]
        beside = target - [x, z]
        if np.linalg.norm(beside) < 0.05 or observation["wrench"][1] > 6:  # there, or pressed hard: try another place
            target = observation["goal"][[0, 2]] + random.uniform(-1.5, 1.5, 2)
        pressing = observation["wrench"][1] > 2
        action = [beside[0], 0.1 if pressing else -0.3, beside[1], 0, 0, 0]
        observation, _, seated, truncated, info = task.step(np.clip(action, -0.5, 0.5))
        actions += 1
        over = seated or truncated
    print(f"seed {seed}: {'seated' if seated else 'not seated'} after {actions} actions, {info['distance_mm']:.2f} mm from the goal")
    sys.exit(not seated)
