"""Solves the same contact problems with every solver: time against error.  compare_solvers.py [PROBLEMS]"""

import sys
import time

import numpy as np

import touchstone as ts

count = int(sys.argv[1]) if len(sys.argv) > 1 else 50
random = np.random.default_rng(1)
stiffness = np.array([1, 1, 1, 1000, 1000, 1000.0])


def problem(rows=100):
    """Contacts on a cap of a sphere of 40 mm that is pressed 5 mm into a wall of points."""
    n = random.normal(size=(rows, 3)) * [0.3, 0.3, 0] + [0, 0, 1]
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    arms = -40 * n + random.normal(size=(rows, 3))
    wanted = np.array([*random.normal(size=2), -5, *0.05 * random.normal(size=3)])
    return np.hstack([n, np.cross(arms, n)]), random.uniform(0, 0.5, rows), stiffness, wanted


problems = [problem() for _ in range(count)]
exact = [ts.solve_qp(*p) for p in problems]
print("solver            tolerance_N  microseconds  force_error_N  iterations")
for name in ts.solvers():
    for tolerance in [0.1, 0.01, 0.001] if name == "pqp" else [0]:
        began = time.process_time()
        answers = [ts.solve_qp(*p, solver=name, tolerance=tolerance or 0.01) for p in problems]
        microseconds = 1e6 * (time.process_time() - began) / count
        error = max(np.linalg.norm(stiffness[:3] * (a.x - e.x)[:3]) for a, e in zip(answers, exact))
        iterations = np.mean([a.iterations for a in answers])
        print(f"{name:<16}  {tolerance:>11}  {microseconds:12.1f}  {error:13.2e}  {iterations:10.1f}")
