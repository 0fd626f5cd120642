"""The insertion task."""

import sys

import numpy as np

import touchstone as ts
from common import SOURCE, TestCase

sys.path.insert(0, str(SOURCE / "docs/examples/python"))
import peg_parts  # noqa: E402


class Insertion(TestCase):
    def setUp(self):
        super().setUp()
        self.scene = ts.Scene(peg_parts.write(self.folder / "peg.glb"))

    def episode(self, seed, **options):
        task = ts.Insertion(self.scene, **options)
        observation, info = task.reset(seed=seed)
        rows = [np.concatenate([observation[key] for key in ("pose", "goal", "wrench")])]
        while True:
            way = self.scene.goal.pose[:3] - observation["pose"][:3]
            way[1] *= np.hypot(way[0], way[2]) < 0.05  # first over the hole
            observation, reward, terminated, truncated, info = task.step([*np.clip(way, -0.5, 0.5), 0, 0, 0])
            self.assertTrue(observation["pose"] in task.observation_space["pose"])
            rows.append(np.concatenate([observation["pose"], observation["goal"], observation["wrench"], [reward]][:3]))
            if terminated or truncated:
                return np.array(rows), terminated, truncated, info

    def test_a_peg_is_seated_and_seeds_determine_the_bits(self):
        rows, terminated, truncated, info = self.episode(3, start_error_mm=1.0)
        self.assertTrue(terminated and not truncated and info["seated"])
        self.assertLess(info["distance_mm"], 0.6)
        self.same(self.episode(3, start_error_mm=1.0)[0], rows)
        self.assertFalse(np.array_equal(self.episode(4, start_error_mm=1.0)[0][0], rows[0]))

    def test_without_time_it_is_truncated(self):
        rows, terminated, truncated, _ = self.episode(3, max_actions=5)
        self.assertTrue(truncated and not terminated)
        self.assertEqual(len(rows), 6)

    def test_the_observed_goal_has_the_error_asked_for(self):
        task = ts.InsertionBatch(self.scene, 50, goal_error_mm=0.5)
        off = task.reset(np.arange(50))["goal"][:, :3] - self.scene.goal.pose[:3]
        self.assertLessEqual(np.abs(off).max(), 0.5)
        self.assertGreater(np.abs(off).max(), 0.3)
        self.same(ts.InsertionBatch(self.scene, 50).reset(np.arange(50))["goal"][7], self.scene.goal.pose)

    def test_the_device_goes_no_further_than_the_force_allows(self):
        task = ts.Insertion(self.scene, start_error_mm=3.0, max_force_N=4.0)
        task.reset(seed=2)
        for _ in range(60):  # beside the hole, onto the block
            _, _, _, _, info = task.step([0.3, -1, 0, 0, 0, 0])
        self.assertGreater(info["max_force_N"], 3)
        self.assertLess(info["max_force_N"], 4.5)

    def test_a_batch_is_many_of_the_same(self):
        batch = ts.InsertionBatch(self.scene, 3, start_error_mm=1.0)
        batch.reset([5, 6, 7])
        alone = ts.InsertionBatch(self.scene, 1, start_error_mm=1.0)
        alone.reset([6])
        action = np.tile([0.1, -0.5, 0, 0, 0.01, 0], (3, 1))
        for _ in range(40):
            all_of, reward, _, _, _ = batch.act(action)
            one, reward_of_one, _, _, _ = alone.act(action[:1])
        self.same(all_of["pose"][1], one["pose"][0])
        self.same(all_of["wrench"][1], one["wrench"][0])
        self.assertEqual(reward[1], reward_of_one[0])
        self.assertGreater(np.abs(one["wrench"]).max(), 1)
        batch.reset([9], [1])
        self.same(batch.act(action)[0]["pose"][2], batch.batch.poses[2])

    def test_wrong_arguments_are_named(self):
        task = ts.Insertion(self.scene)
        task.reset(seed=1)
        with self.assertRaisesRegex(ValueError, r"shape \(1, 6\)"):
            task.step([1, 2, 3])
        with self.assertRaisesRegex(ValueError, "finite"):
            task.step([np.nan] * 6)
        with self.assertRaisesRegex(ValueError, "no goal"):
            ts.Insertion("bunnies")
        with self.assertRaisesRegex(ValueError, "step_mm"):
            ts.Insertion(self.scene, step_mm=-1)

    def test_box(self):
        box = ts.Box([-1, -1, -np.inf], [1, 2, np.inf], (3,), seed=1)
        samples = np.array([box.sample() for _ in range(200)])
        self.assertTrue(all(sample in box for sample in samples))
        self.assertGreater(samples[:, 1].max(), 1.5)
        self.assertNotIn(np.array([0, 3, 0]), box)
        self.assertFalse(box.contains([0, 0]))
