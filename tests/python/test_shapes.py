"""Surfaces, sphere trees and solvers of arrays."""

import numpy as np

import touchstone as ts
from common import TestCase, box

AT = np.array([0, 0, 0, 1.0, 0, 0, 0])
STIFFNESS = [1, 1, 1, 1000, 1000, 1000]


class Shapes(TestCase):
    def test_distance_and_overlap_of_boxes(self):
        surface = ts.Surface(*box())
        self.assertEqual((surface.faces, surface.convex_edges, surface.tips), (12, 12, 8))
        beside = AT + [13, 0, 0, 0, 0, 0, 0]
        self.assertFalse(surface.overlaps(surface, beside))
        distance, on_self, on_other = surface.nearest(surface, beside)
        self.assertAlmostEqual(distance, 3)
        self.assertAlmostEqual(on_self[0], 5)
        self.assertAlmostEqual(on_other[0], 8)
        self.assertIsNone(surface.nearest(surface, beside, at_most=1))
        self.assertTrue(surface.overlaps(surface, AT + [9, 1, 1, 0, 0, 0, 0]))
        self.assertAlmostEqual(surface.depth(surface, AT + [9, 1, 1, 0, 0, 0, 0]), 1)
        self.same(surface.contains([[0, 0, 0], [4.9, 0, 0], [5.1, 0, 0]]), [True, True, False])
        np.testing.assert_allclose(surface.distance([[0, 0, 0], [7, 0, 0]]), [5, 2])

    def test_an_open_mesh_is_refused_with_its_holes(self):
        vertices, triangles = box()
        with self.assertRaisesRegex(ValueError, "not closed: it has 1 hole"):
            ts.Surface(vertices, triangles[:-2])
        with self.assertRaisesRegex(ValueError, r"triangles\[0\] names vertex 9 of 8"):
            ts.Surface(vertices, [[0, 1, 9]])
        with self.assertRaisesRegex(ValueError, "finite"):
            ts.Surface(vertices * np.inf, triangles)

    def test_a_tree_covers_and_is_read_back(self):
        vertices, triangles = box()
        tree = ts.SphereTree(vertices, triangles, 64)
        self.assertLessEqual(len(tree), 64)
        self.assertTrue(tree.certificate["covered"] and tree.certificate["closed"])
        self.assertEqual(tree.refute(vertices, triangles), "")
        self.assertNotEqual(tree.refute(vertices * 1.2, triangles), "")
        centers, radii = tree.leaves[:, :3], tree.leaves[:, 3]
        for point in vertices:
            self.assertTrue((np.linalg.norm(centers - point, axis=1) <= radii * (1 + 1e-6)).any())
        tree.save(str(self.folder / "box.tree"))
        self.same(ts.SphereTree.load(str(self.folder / "box.tree")).leaves, tree.leaves)
        with self.assertRaisesRegex(ValueError, "quality"):
            ts.SphereTree(vertices, triangles, 64, quality="bad")
        with self.assertRaises(ValueError):
            ts.SphereTree.load(str(self.folder / "none.tree"))

    def test_a_qp_with_one_contact(self):
        row = [[0, 0, 1, 0, 0, 0]]  # z of C may not go below -0.5 mm, and 2 mm are wanted at 1 N/mm
        for solver in ts.solvers():
            answer = ts.solve_qp(row, [0.5], STIFFNESS, [0, 0, -2, 0, 0, 0], solver=solver, tolerance=1e-6)
            np.testing.assert_allclose(answer.x, [0, 0, -0.5, 0, 0, 0], atol=1e-4)
            np.testing.assert_allclose(answer.forces, [1.5], atol=1e-4)
        self.assertLess(max(ts.solve_qp(row, [0.5], STIFFNESS, [0, 0, -2, 0, 0, 0]).residuals.values()), 1e-12)
        self.same(ts.solve_qp(np.zeros((0, 6)), [], STIFFNESS, [1, 2, 3, 0, 0, 0]).x, [1, 2, 3, 0, 0, 0])
        with self.assertRaisesRegex(ValueError, "no solver 'magic': choose one of dual-active-set"):
            ts.solve_qp(row, [0.5], STIFFNESS, np.zeros(6), solver="magic")
        with self.assertRaisesRegex(ValueError, "stiffness must be positive"):
            ts.solve_qp(row, [0.5], np.zeros(6), np.zeros(6))

    def test_a_foot_sticks_and_slides(self):
        wanted = np.array([0.5, 0, -1, 0, 0, 0])
        for coefficient, force, x in [(0.6, [-0.5, 0, 1], 0), (0.2, [-0.2, 0, 1], 0.3)]:
            answer = ts.solve_friction([[0, 0, 1]], [[0, 0, 0]], [0], [coefficient], STIFFNESS, wanted)
            self.assertEqual(answer.status, "exact")
            np.testing.assert_allclose(answer.forces, [force], atol=1e-6)
            self.assertAlmostEqual(answer.x[0], x, 6)
        with self.assertRaisesRegex(ValueError, "contact 0 needs a normal of length 1"):
            ts.solve_friction([[0, 0, 2]], [[0, 0, 0]], [0], [0.1], STIFFNESS, wanted)
