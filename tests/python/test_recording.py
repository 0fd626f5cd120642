"""Recordings as arrays, replayed to the bit."""

import numpy as np

import touchstone as ts
from common import TestCase, box, program


class Recordings(TestCase):
    def test_what_the_program_recorded(self):
        folder = self.folder / "push"
        program("run", "hello", "--headless", "--record", folder)
        recording = ts.Recording(folder)
        self.assertIsInstance(recording.ticks, np.memmap)
        self.assertEqual(recording.ticks.dtype, ts.tick_type)
        self.assertEqual(len(recording), 2401)
        check = recording.replay()
        self.assertEqual((check["ticks"], check["same"], check["first_different"]), (2401, 2401, None))
        rows = ts.World(recording.scene).run(recording.poses("input"))
        for k, name in enumerate(("force_o_x_N", "force_o_y_N", "force_o_z_N")):
            self.same(rows[name], recording.wrenches()[:, k])
        softer = recording.replay(recording.scene.settings.with_(stiffness=0.2))
        self.assertLess(softer["same"], 2401)

    def test_the_last_pose_in_the_file_of_the_tool(self):
        folder = self.folder / "push"
        reported = ts.run(ts.Scene("hello"), seconds=0.5, record=str(folder)).report["tool_pose"]
        recorded = ts.Recording(folder).tool_pose
        self.same(recorded["matrix"], np.array(reported["matrix"]))
        self.assertEqual((recorded["unit_m"], recorded["frame"]), (reported["unit_m"], reported["frame"]))
        # From a file in inches: a quarter turn about z, and 25.4 mm along x.
        inch = {"tool": {"file": {"unit_m": 0.0254}}}
        ts.write_scene(self.folder / "inch.glb", box(), {"plate": box((30, 30, 4))}, start=(0, 0, 20, 1, 0, 0, 0), keys=inch)
        half = np.sqrt(0.5)
        place = ts.Scene(self.folder / "inch.glb").tool_pose((25.4, 0, 0, half, 0, 0, half))
        self.assertEqual((place["unit_m"], place["frame"]), (0.0254, "file"))
        wanted = [[0, -1, 0, 1], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
        np.testing.assert_allclose(place["matrix"], wanted, atol=1e-12)

    def test_what_python_records_the_program_replays(self):
        scene = ts.Scene("hello")
        run = ts.run(scene, record=str(self.folder / "mine"))
        self.assertIn("all of 2401 ticks", program("run", "hello", "--headless", "--device", f"replay:{self.folder / 'mine'}"))
        self.same(ts.Recording(self.folder / "mine").ticks["tool_y_mm"], run.ticks["tool_y_mm"])
        with self.assertRaisesRegex(ValueError, "holds a recording already"):
            ts.run(scene, record=str(self.folder / "mine"))

    def test_the_scene_is_found_where_it_is_now(self):
        was, now = self.folder / "was", self.folder / "now"
        was.mkdir()
        ts.write_scene(was / "boxes.glb", box(), {"plate": box((30, 30, 4))}, start=(0, 0, 20, 1, 0, 0, 0))
        ts.run(ts.Scene(was / "boxes.glb"), "rest", seconds=0.05, record=str(was / "rest"))
        was.rename(now)
        recording = ts.Recording(now / "rest")
        self.assertEqual(recording.replay()["same"], 50)
        (now / "boxes.glb").rename(self.folder / "far.glb")
        with self.assertRaisesRegex(ts.SceneError, r"boxes\.glb \(content hash .* is missing: .*Recording\(folder, scene\)"):
            recording.scene
        self.assertEqual(ts.Recording(now / "rest", self.folder / "far.glb").replay()["same"], 50)
        # A bundled scene is found by its name wherever the program was.
        ts.run(ts.Scene("hello"), seconds=0.05, record=str(self.folder / "hello"))
        notes = self.folder / "hello/recording.json"
        notes.write_text(notes.read_text().replace(str(ts.find_scene("hello").parent), "/no/such/folder"))
        self.assertEqual(ts.Recording(self.folder / "hello").replay()["same"], 50)

    def test_what_is_no_recording(self):
        with self.assertRaisesRegex(ValueError, "is no recording that can be read"):
            ts.Recording(self.folder)
        (self.folder / "recording.json").write_text("{}")
        (self.folder / "ticks.npy").write_bytes(b"\x93NUMPY")
        with self.assertRaisesRegex(ValueError, "touchstone recover"):
            ts.Recording(self.folder)
