"""What the tests of the Python package share."""

import os
import subprocess
import tempfile
import unittest
from pathlib import Path

import numpy as np

SOURCE = Path(__file__).resolve().parents[2]
BUILD = Path(os.environ["TOUCHSTONE_BUILD"])


def program(*arguments):
    """Runs the program of the same build; returns what it printed."""
    return subprocess.run([BUILD / "touchstone", *map(str, arguments)], check=True, capture_output=True, text=True).stdout


def box(size=(10, 10, 10)):
    """A box around the origin: vertices and triangles."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * np.asarray(size) / 2
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return corners, np.array([t for a, b, c, d in sides for t in ((a, b, c), (a, c, d))])


class TestCase(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def same(self, a, b, message=None):
        np.testing.assert_array_equal(a, b, err_msg=message or "")
