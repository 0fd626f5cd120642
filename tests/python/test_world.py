"""Worlds, batches and runs against the program, to the bit."""

import json
import os
import pickle
import signal
import subprocess
import sys
import threading
import time

import numpy as np

import touchstone as ts
from common import TestCase, box, program


class Worlds(TestCase):
    def test_a_run_has_the_bits_of_the_program(self):
        for scene, options in [("hello", {}), ("bunnies", {"geometry": "spheres", "stiffness": 0.4}), ("drawer", {})]:
            settings = ts.Scene(scene).settings.with_(**options)
            run = ts.run(ts.Scene(scene), settings=settings, seconds=1.5)
            report = self.folder / f"{scene}.json"
            sets = [word for key, value in options.items() for word in ("--set", f"{key}={value}")]
            program("run", scene, "--headless", "--device", "demo", "--seconds", 1.5, "--report", report, *sets)
            self.assertEqual(run.report["hash"], json.loads(report.read_text())["hash"], scene)
            self.assertEqual(len(run.ticks), 1500)

    def test_a_world_has_the_ticks_of_a_run(self):
        scene = ts.Scene("bunnies")
        ticks = ts.run(scene, seconds=3).ticks
        rows = ts.World(scene).run(scene.motions[0].poses()[:3000])
        self.assertGreater(np.count_nonzero(rows["force_y_N"]), 500)
        for name in ("tool_x_mm", "tool_qw", "force_x_N", "torque_o_z_mNm", "flags", "rows", "tick"):
            self.same(rows[name], ticks[name], name)

    def test_step_and_run_and_batch_are_the_same(self):
        scene = ts.Scene("bunnies")
        devices = scene.motions[0].poses()
        one = ts.World(scene)
        touched = np.flatnonzero(one.run(devices)["force_y_N"])[0]
        devices = devices[touched - 100 : touched + 400]
        one.reset(devices[0])
        rows = one.run(devices)
        again = ts.World(scene)
        again.reset(devices[0])
        stepped = [again.step(device) for device in devices]
        batch = ts.Batch(scene, 3, threads=2)
        batch.reset(np.tile(devices[0], (3, 1)))
        poses, wrenches = batch.run(np.repeat(devices[:, None], 3, axis=1))
        other = ts.Batch(scene, 3)
        other.reset(devices[:1], [1])
        for device in devices:
            last = other.step(np.tile(device, (3, 1)))
        for k, name in enumerate(("x_mm", "y_mm", "z_mm", "qw", "qx", "qy", "qz")):
            self.same(rows["tool_" + name], [pose[k] for pose, _ in stepped])
            for world in range(3):
                self.same(rows["tool_" + name], poses[:, world, k])
        self.same(wrenches[-1, 0], stepped[-1][1])
        self.same(last[1][1], stepped[-1][1])
        self.assertGreater(np.abs(wrenches).max(), 1)
        self.same(batch.ticks[1].tobytes(), batch.ticks[2].tobytes())
        self.same(again.pose, poses[-1, 0])
        self.assertEqual(again.tick["tool_x_mm"], poses[-1, 0, 0])

    def test_settings_of_each_world_of_a_batch(self):
        scene = ts.Scene("hello")
        devices = scene.motions[0].poses()
        stiff = [scene.settings.with_(stiffness=k) for k in (0.1, 1.0)]
        _, wrenches = ts.Batch(scene, 2, stiff).run(np.repeat(devices[:, None], 2, axis=1))
        for k, settings in enumerate(stiff):
            rows = ts.World(scene, settings).run(devices)
            self.same(wrenches[:, k, 1], rows["force_o_y_N"])
        self.assertGreater(wrenches[:, 1, 1].max(), 5 * wrenches[:, 0, 1].max())

    def test_an_invalid_device_pose_holds_the_tool_without_force(self):
        scene = ts.Scene("hello")
        world = ts.World(scene)
        before = world.step(scene.start)[0]
        pose, wrench = world.step([np.nan, 0, 0, 1, 0, 0, 0])
        self.same(pose, before)
        self.same(wrench, np.zeros(6))
        self.assertTrue(world.tick["flags"] & 1 << 9)

    def test_obstacles_move(self):
        scene = ts.Scene("hello")
        world = ts.World(scene)
        target = world.obstacles + [0, 30, 0, 0, 0, 0, 0]
        for _ in range(300):
            _, wrench = world.step(scene.start, target)
        self.assertGreater(world.obstacles[0, 1], 1)
        self.assertGreater(wrench[1], 0.1)
        self.assertLess(world.penetration(), 1e-3)
        world.reset()
        self.same(world.obstacles, [part.pose for part in scene.obstacles])

    def test_clearance_and_penetration(self):
        scene = ts.Scene(ts.write_scene(self.folder / "a.glb", box(), {"b": box()}, start=[0, 20, 0, 1, 0, 0, 0]))
        world = ts.World(scene)
        self.assertAlmostEqual(world.clearance(), 10, 5)
        self.assertEqual(world.clearance(at_most=2), 2)
        self.assertEqual(world.penetration(), 0)
        self.assertAlmostEqual(world.penetration([1, 9, 2, 1, 0, 0, 0]), 1, 5)

    def test_wrong_arguments_are_named(self):
        scene = ts.Scene("hello")
        world = ts.World(scene)
        for call, words in [
            (lambda: world.step([1, 2, 3]), r"device must have the shape \(7,\), not \(3,\)"),
            (lambda: world.run(np.zeros((4, 6))), r"devices must have the shape \(n, 7\), not \(4, 6\)"),
            (lambda: world.reset([0, 0, 0, 2, 0, 0, 0]), "pose is no pose"),
            (lambda: world.step(scene.start, np.zeros((5, 7))), r"obstacles must have the shape \(1, 7\)"),
            (lambda: ts.World(scene, ts.Settings(margin=0.1, trust=0.5)), "trust"),
            (lambda: ts.Batch(scene, 0), "at least one world"),
            (lambda: ts.Batch(scene, 2, [scene.settings]), "1 entries for 2 worlds"),
            (lambda: ts.Scene("bunnys"), "did you mean 'bunnies'"),
            (lambda: ts.Scene(__file__), "test_world.py"),
            (lambda: ts.run(scene, "demo:nothing"), "nothing"),
            (lambda: ts.run(scene, seconds=float("nan")), "seconds must be above 0"),
            (lambda: ts.Scene("hello", leaves=-5), "leaves must be from 8"),
            (lambda: ts.Batch(scene, -1), "at least one world"),
            (lambda: ts.Batch(scene, 2).reset(worlds=[0.5]), "whole numbers"),
            (lambda: ts.Batch(scene, 2).reset(worlds=[1, 1]), "twice"),
            (lambda: ts.Batch(scene, 2).reset(worlds=[True]), "mask"),
            (lambda: ts.run(scene, "xx"), "unknown device 'xx'"),
            (lambda: scene.motions[0].poses(np.inf), "rate_hz"),
        ]:
            with self.assertRaisesRegex(ValueError, words):
                call()
        with self.assertRaisesRegex(TypeError, "^scene must be a Scene, .* not str$"):
            ts.World("hello")
        with self.assertRaises(IndexError):
            ts.Batch(scene, 2).reset(worlds=[2])

    def test_a_mask_chooses_worlds(self):
        scene = ts.Scene("hello")
        batch = ts.Batch(scene, 3)
        batch.run(np.tile(scene.motions[0].poses(1000)[:500, None], (1, 3, 1)))
        moved = batch.poses.copy()
        batch.reset(worlds=[False, True, False])
        self.same(batch.poses[1], scene.start)
        self.same(batch.poses[[0, 2]], moved[[0, 2]])

    def test_a_start_inside_an_obstacle_is_told(self):
        scene = ts.Scene("hello")
        world = ts.World(scene)
        self.assertIs(world.reset(), False)
        inside = scene.start.copy()
        inside[1] -= 12
        self.assertIs(world.reset(inside), True)
        world.step(inside)
        self.assertIn(ts.Flag.OVERLAPPING, ts.Flag(int(world.tick["flags"])))
        self.assertEqual(ts.Batch(scene, 2).reset([scene.start, inside]).tolist(), [False, True])

    def test_an_object_without_value_is_refused(self):
        with self.assertRaisesRegex(TypeError, "has no value"):
            ts.Scene.__new__(ts.Scene).name
        with self.assertRaisesRegex(TypeError, "has no value"):
            ts.World.__new__(ts.World).pose

    def test_settings_are_a_mapping(self):
        settings = ts.Settings(stiffness=0.5, friction=False, solver="pqp")
        self.assertEqual(dict(settings)["stiffness"], 0.5)
        self.assertIs(settings["friction"], False)
        self.assertEqual(settings["solver"], "pqp")
        self.assertEqual(ts.Settings(**dict(settings)), settings)
        self.assertEqual(pickle.loads(pickle.dumps(settings)), settings)
        self.assertEqual(ts.Settings().in_mode("paper")["solver"], "pqp")
        self.assertIn("N/mm", ts.Settings.help("stiffness"))
        self.assertIn("stiffness=0.5", repr(settings))
        with self.assertRaises(KeyError):
            settings["stifness"] = 1
        with self.assertRaisesRegex(ValueError, "stiffness"):
            settings["stiffness"] = -1
        with self.assertRaisesRegex(ValueError, "solver"):
            settings["solver"] = "magic"

    def test_a_batch_runs_beside_other_threads_and_ends_at_an_interrupt(self):
        scene = ts.Scene("hello")
        batch = ts.Batch(scene, 64, threads=1)
        devices = np.tile(scene.motions[0].poses()[:, None], (1, 64, 1))
        done = threading.Event()

        def work():
            while not done.is_set():
                try:
                    batch.run(devices)
                    done.set()
                except RuntimeError:  # the other thread was first
                    pass

        worker = threading.Thread(target=work)
        worker.start()
        turns = 0
        refused = 0
        while not done.is_set() and refused == 0:
            try:
                batch.step(devices[0])
            except RuntimeError as error:
                self.assertIn("another thread", str(error))
                refused += 1
        self.assertEqual(refused, 1)
        while not done.is_set():
            turns += 1
            time.sleep(1e-4)
        worker.join()
        self.assertGreater(turns, 10)
        endless = (  # unless this test is killed, which interrupts nothing
            "import os, sys, touchstone as ts, numpy as np\n"
            "s = ts.Scene('bunnies'); b = ts.Batch(s, 20); d = np.tile(s.motions[0].poses()[:, None], (1, 20, 1))\n"
            "print('ready', flush=True)\n"
            "try:\n    while os.getppid() == int(sys.argv[1]): b.run(d)\n"
            "except KeyboardInterrupt: print('stopped')\n"
        )
        child = subprocess.Popen(
            [sys.executable, "-c", endless, str(os.getpid())], stdout=subprocess.PIPE, text=True
        )
        self.addCleanup(child.kill)
        self.assertEqual(child.stdout.readline(), "ready\n")
        time.sleep(0.5)
        child.send_signal(signal.SIGINT)
        self.assertEqual(child.communicate(timeout=60)[0], "stopped\n")
