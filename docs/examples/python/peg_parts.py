"""A square peg and a block with a hole, as a scene: what random_search.py and train_policy.py insert."""

import numpy as np

import touchstone as ts


def ring(half, y):
    """The corners of a square, counter-clockwise seen from above, mm."""
    return [(-half, y, half), (half, y, half), (half, y, -half), (-half, y, -half)]


def wall(lower, upper):
    """The triangles between two rings, with their front away from the middle."""
    return [t for k in range(4) for a, b, c, d in [(lower + k, lower + (k + 1) % 4, upper + (k + 1) % 4, upper + k)]
            for t in ((a, b, c), (a, c, d))]


def peg(width=10.0, length=30.0):
    """A box whose lower end is at the origin."""
    vertices = np.array(ring(width / 2, 0) + ring(width / 2, length))
    return vertices, np.array(wall(0, 4) + [(4, 5, 6), (4, 6, 7), (2, 1, 0), (3, 2, 0)])


def block(hole=10.4, width=40.0, depth=20.0):
    """A block with a square hole through it, top at y = 0."""
    vertices = np.array(ring(width / 2, -depth) + ring(width / 2, 0) + ring(hole / 2, -depth) + ring(hole / 2, 0))
    outside, hole_wall = wall(0, 4), [t[::-1] for t in wall(8, 12)]
    top, bottom = wall(4, 12), [t[::-1] for t in wall(0, 8)]
    return vertices, np.array(outside + hole_wall + top + bottom)


def write(file, clearance=0.2):
    """The scene: the peg 5 mm above the hole, and its goal 10 mm deep in it."""
    up, down = np.array([0, 5.0, 0, 1, 0, 0, 0]), np.array([0, -10.0, 0, 1, 0, 0, 0])
    return ts.write_scene(
        file, peg(), {"block": block(10 + 2 * clearance)}, start=up, goal=down,
        goal_keys={"tolerance_m": 0.0006, "tolerance_rad": 0.1, "depth_m": 0.01, "fold": 4},
    )
