"""Touchstone: rigid contact with six degrees of freedom, as the program computes it.

Lengths are in mm, forces in N, torques in mN·m, angles in rad, times in ms. A pose is an array x, y, z, qw, qx, qy, qz of
a part in the scene frame; a wrench is force and torque on the hand, about the tool's origin, on the axes of the scene.
"""

from . import _processor
from . import pose
from ._core import (
    Answer,
    Batch,
    Flag,
    Goal,
    Motion,
    Part,
    Run,
    SceneError,
    Settings,
    SphereTree,
    Status,
    Surface,
    World,
    __version__,
    friction_solvers,
    run,
    solve_friction,
    solve_qp,
    solvers,
    tick_type,
)
from ._recording import Recording
from ._scene import Scene, find_scene, scenes, write_scene
from .insertion import Box, Insertion, InsertionBatch

__all__ = [
    "Answer",
    "Batch",
    "Box",
    "Flag",
    "Goal",
    "Insertion",
    "InsertionBatch",
    "Motion",
    "Part",
    "Recording",
    "Run",
    "Scene",
    "SceneError",
    "Settings",
    "SphereTree",
    "Status",
    "Surface",
    "World",
    "__version__",
    "find_scene",
    "friction_solvers",
    "pose",
    "run",
    "scenes",
    "solve_friction",
    "solve_qp",
    "solvers",
    "tick_type",
    "write_scene",
]
