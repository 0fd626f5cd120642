"""Scenes, parts, goals, motions, and scenes made of arrays."""

import numpy as np

import touchstone as ts
from common import TestCase, box, program


class Scenes(TestCase):
    def test_bundled_scenes(self):
        self.assertIn("bunnies", ts.scenes())
        scene = ts.Scene("peg-h7")
        self.assertEqual(scene.name, "peg-h7")
        self.assertTrue(scene.tool.closed)
        self.assertEqual(scene.tool.defect, "")
        vertices, triangles = scene.tool.mesh
        self.assertLess(triangles.max(), len(vertices))
        self.assertIsNone(scene.tool.tree)
        self.same(scene.motions[0](0.0), scene.start)
        self.assertTrue(scene.goal.contains(scene.goal.pose))
        self.assertFalse(scene.goal.contains(scene.start))
        self.assertAlmostEqual(np.linalg.norm(scene.goal.out), 1)

    def test_the_fit_is_that_of_the_program(self):
        import json

        for name, places in [("hook", ["goal"]), ("pinch", ["least"])]:
            fit = ts.Scene(name).fit()
            printed = json.loads(program("fit", name, "--json"))
            self.assertEqual(fit["fits"], printed["fits"])
            self.assertEqual(fit["verdict"], printed["verdict"])
            for place in places:
                self.assertEqual(fit[place]["clearance_mm"], printed[place]["clearance_mm"])

    def test_trees_come_when_they_are_needed(self):
        scene = ts.Scene("hello")
        self.assertIsNone(scene.tool.tree)
        ts.World(scene, scene.settings.with_(geometry="spheres"))
        self.assertGreater(len(scene.tool.tree), 8)
        self.assertGreater(len(ts.Scene("hello", trees=True, leaves=64).tool.tree), 8)

    def test_a_scene_of_arrays(self):
        times, path = np.array([0.0, 500, 1000]), np.zeros((3, 7))
        path[:, 1], path[:, 3] = [12, 9, 12], 1
        rubber = {"staticFriction": 0.5, "dynamicFriction": 0.4}
        file = ts.write_scene(
            self.folder / "boxes.glb", box(), {"table": box((60, 10, 60))}, start=path[0],
            poses={"table": [0, -3, 0, 1, 0, 0, 0]}, goal=[0, 7, 0, 1, 0, 0, 0], goal_keys={"tolerance_m": 0.003},
            demonstration=(times, path), keys={"tool": rubber, "table": rubber},
        )
        scene = ts.Scene(file)
        self.assertEqual(scene.warnings, [])
        self.assertEqual([part.name for part in scene.obstacles], ["table"])
        np.testing.assert_allclose(scene.motions[0](250.0), [0, 10.5, 0, 1, 0, 0, 0], atol=1e-5)
        self.assertEqual(scene.goal.tolerance_mm, 3)
        rows = ts.World(scene).run(scene.motions[0].poses())
        self.assertEqual(rows["force_y_N"].max(), 0)  # the boxes' faces are 2 mm apart at the lowest point
        self.assertIn("valid", program("validate", file))
        deep = path.copy()
        deep[1, 1] = 5
        scene = ts.Scene(ts.write_scene(self.folder / "push.glb", box(), {"table": box((60, 10, 60))},
                                        poses={"table": [0, -3, 0, 1, 0, 0, 0]}, start=path[0], demonstration=(times, deep)))
        rows = ts.World(scene).run(scene.motions[0].poses())
        self.assertAlmostEqual(rows["force_y_N"].max(), 2, 1)  # 2 mm at 1 N/mm
        self.assertAlmostEqual(rows["tool_y_mm"].min(), 7, 2)

    def test_wrong_arrays_are_named(self):
        corners, triangles = box()
        for mesh, words in [
            ((corners, triangles + 1), "below the number of vertices"),
            ((corners[:, :2], triangles), r"vertices \(n, 3\)"),
            ((corners * np.nan, triangles), "finite"),
        ]:
            with self.assertRaisesRegex(ValueError, words):
                ts.write_scene(self.folder / "wrong.glb", mesh, {"b": box()})
        with self.assertRaisesRegex(ValueError, "no part 'c'"):
            ts.write_scene(self.folder / "wrong.glb", box(), {"b": box()}, poses={"c": [0, 0, 0, 1, 0, 0, 0]})
        with self.assertRaisesRegex(ValueError, "ends in .glb"):
            ts.write_scene(self.folder / "wrong.stl", box(), {"b": box()})
        self.assertEqual(list(self.folder.iterdir()), [])

    def test_poses(self):
        random = np.random.default_rng(1)
        a = ts.pose.moved(np.tile(ts.pose.IDENTITY, (20, 1)), random.normal(size=(20, 6)))
        b = ts.pose.moved(a, random.normal(size=(20, 6)))
        for again in (ts.pose.moved(a, ts.pose.motion(a, b)), ts.pose.compose(a, ts.pose.compose(ts.pose.inverse(a), b))):
            again[:, 3:] *= np.sign(np.sum(again[:, 3:] * b[:, 3:], axis=-1, keepdims=True))  # q and -q turn alike
            np.testing.assert_allclose(again, b, atol=1e-12)
        points = random.normal(size=(20, 3))
        np.testing.assert_allclose(ts.pose.apply(ts.pose.inverse(a), ts.pose.apply(a, points)), points, atol=1e-12)
        quarter = ts.pose.moved(ts.pose.IDENTITY, [1, 0, 0, 0, np.pi / 2, 0])
        np.testing.assert_allclose(ts.pose.apply(quarter, [0, 0, 1]), [2, 0, 0], atol=1e-12)
