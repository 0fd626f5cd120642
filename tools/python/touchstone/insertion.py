"""Insertion as a task for learning: put the tool of a scene where its goal is.

Insertion has the signatures of a Gymnasium environment without needing Gymnasium; InsertionBatch is the same task many
times at once, on all cores.
"""

from __future__ import annotations

import os
from typing import Any, Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import pose as poses
from ._core import Batch, SceneFile, Settings
from ._scene import Scene

Array = NDArray[np.float64]
Observation = dict[str, Array]

# An error that leaves one start in ten free finds it all but surely: 0.9^200 is 7e-10.
_TRIES = 200


class Box:
    """All arrays of a shape between two bounds, as gymnasium.spaces.Box."""

    def __init__(self, low: ArrayLike, high: ArrayLike, shape: tuple[int, ...], seed: int | None = None) -> None:
        self.low = np.broadcast_to(np.asarray(low, float), shape).copy()
        self.high = np.broadcast_to(np.asarray(high, float), shape).copy()
        self.shape = shape
        self.dtype = np.dtype(float)
        self._random = np.random.default_rng(seed)

    def seed(self, seed: int | None = None) -> None:
        self._random = np.random.default_rng(seed)

    def sample(self) -> Array:
        """Uniform where both bounds are finite, else normal."""
        bounded = np.isfinite(self.low) & np.isfinite(self.high)
        low, high = np.where(bounded, self.low, 0), np.where(bounded, self.high, 1)
        return np.where(bounded, self._random.uniform(low, high), self._random.normal(size=self.shape))

    def contains(self, x: ArrayLike) -> bool:
        x = np.asarray(x)
        return x.shape == self.shape and bool(np.all(x >= self.low) and np.all(x <= self.high))

    def __contains__(self, x: ArrayLike) -> bool:
        return self.contains(x)

    def __repr__(self) -> str:
        return f"Box{self.shape}"


class InsertionBatch:
    """The task of Insertion in `count` worlds at once. Arrays have the worlds as their first axis.

    scene: with a goal. settings: of the tick; the scene's by default. ticks: of the tick, 1 ms each at 1 kHz, per action.
    max_actions: an episode ends after as many. step_mm, step_rad: greatest motion of the device in an action.
    start_mm: an episode begins so far from the goal, along its `out`; by default at the start of the scene. Tool and
    device are displaced from there at random by up to start_error_mm, start_error_rad along and about each axis; a start
    that overlaps an obstacle is drawn again.
    goal_error_mm, goal_error_rad: likewise the goal that is observed, for a whole episode. max_force_N, max_torque_mNm:
    the device goes no further from the tool than these pull.
    """

    def __init__(
        self,
        scene: str | os.PathLike[str] | SceneFile,
        count: int,
        *,
        settings: Settings | None = None,
        ticks: int = 20,
        max_actions: int = 250,
        step_mm: float = 1.0,
        step_rad: float = 0.02,
        start_mm: float | None = None,
        start_error_mm: float = 1.0,
        start_error_rad: float = 0.0,
        goal_error_mm: float = 0.0,
        goal_error_rad: float = 0.0,
        max_force_N: float = 15.0,
        max_torque_mNm: float = 300.0,
        threads: int = 0,
    ) -> None:
        self.scene = scene if isinstance(scene, SceneFile) else Scene(scene)
        if self.scene.goal is None:
            raise ValueError(f"scene '{self.scene.name}' has no goal: mark one, see docs/scenes.md")
        if ticks < 1 or max_actions < 1 or count < 1:
            raise ValueError("ticks, max_actions and count must be at least 1")
        sizes = {
            "step_mm": step_mm,
            "step_rad": step_rad,
            "max_force_N": max_force_N,
            "max_torque_mNm": max_torque_mNm,
            "start_error_mm": start_error_mm,
            "start_error_rad": start_error_rad,
            "goal_error_mm": goal_error_mm,
            "goal_error_rad": goal_error_rad,
        }
        for name, value in sizes.items():
            if not (0 <= value < np.inf):
                raise ValueError(f"{name} must be a finite number from 0, not {value}")
        if start_mm is not None and not np.isfinite(start_mm):
            raise ValueError(f"start_mm must be finite, not {start_mm}")
        self.goal = self.scene.goal
        # Without the shadow solver, which only measures.
        self.settings = (self.scene.settings if settings is None else settings).with_(shadow="none")
        self.ticks, self.max_actions = ticks, max_actions
        self.step = np.array([step_mm] * 3 + [step_rad] * 3)
        self.start = np.asarray(self.scene.start)
        if start_mm is not None:
            self.start = self.goal.pose + np.concatenate([start_mm * self.goal.out, np.zeros(4)])
        self.start_error = np.array([start_error_mm] * 3 + [start_error_rad] * 3)
        self.goal_error = np.array([goal_error_mm] * 3 + [goal_error_rad] * 3)
        reach = max_force_N / self.settings["stiffness"], max_torque_mNm / self.settings["torsion"]
        self.reach = np.array(reach)
        self.batch = Batch(self.scene, count, self.settings, threads)
        self.observation_space: dict[str, Box] = {
            "pose": Box(-np.inf, np.inf, (7,)),
            "goal": Box(-np.inf, np.inf, (7,)),
            "wrench": Box(-np.inf, np.inf, (6,)),
        }
        self.action_space = Box(-self.step, self.step, (6,))
        self._device = np.tile(self.scene.start, (count, 1))
        self._pose, self._wrench = self._device.copy(), np.zeros((count, 6))
        self._goal = np.tile(self.goal.pose, (count, 1))
        self._held, self._actions = np.zeros(count), np.zeros(count, int)
        self._distance = np.zeros(count)
        self._first = np.ones(count)

    def __len__(self) -> int:
        return len(self.batch)

    def reset(self, seeds: ArrayLike, worlds: ArrayLike | None = None) -> Observation:
        """Begins episodes, in all worlds, those with these indices (m,) or in this mask (n,), each determined by its seed
        (m,). Raises ValueError if no start is found without overlap; those episodes have not begun then."""
        which = np.array(self.batch._chosen(worlds), int)
        seeds = np.asarray(seeds)
        if seeds.shape != which.shape or seeds.size and not np.issubdtype(seeds.dtype, np.integer):
            raise ValueError(f"seeds must be whole numbers of the shape {which.shape}, not {seeds.dtype} of {seeds.shape}")
        if seeds.size and seeds.min() < 0:
            raise ValueError("seeds must be from 0")
        random = [np.random.default_rng(int(seed)) for seed in seeds]
        again = np.arange(len(which))
        for _ in range(_TRIES):
            for k in again:
                self._device[which[k]] = poses.moved(self.start, self.start_error * random[k].uniform(-1, 1, 6))
            again = again[self.batch.reset(self._device[which[again]], which[again])]
            if not len(again):
                break
        for i, source in zip(which, random):
            self._goal[i] = poses.moved(self.goal.pose, self.goal_error * source.uniform(-1, 1, 6))
        self._pose[which], self._wrench[which] = self._device[which], 0
        self._held[which], self._actions[which] = 0, 0
        self._distance[which] = np.linalg.norm(self._pose[which, :3] - self.goal.pose[:3], axis=-1)
        self._first[which] = np.maximum(self._distance[which], 1e-9)
        if len(again):
            raise ValueError(
                f"the tool overlaps an obstacle at each of {_TRIES} starts drawn from seed {seeds[again[0]]}: make start_mm "
                f"larger, or start_error_mm and start_error_rad smaller"
            )
        return self._observe()

    def act(self, actions: ArrayLike) -> tuple[Observation, Array, NDArray[np.bool_], NDArray[np.bool_], dict[str, Array]]:
        """One action (n, 6) of each world: see Insertion.step(). Worlds whose episode is over go on; reset() them."""
        actions = np.asarray(actions, float)
        if actions.shape != (len(self), 6):
            raise ValueError(f"actions must have the shape ({len(self)}, 6), not {actions.shape}")
        if not np.isfinite(actions).all():
            raise ValueError("actions must be finite")
        wanted = poses.moved(self._device, np.clip(actions, -self.step, self.step))
        pull = poses.motion(self._pose, wanted)
        for part, reach in ((slice(0, 3), self.reach[0]), (slice(3, 6), self.reach[1])):
            length = np.linalg.norm(pull[:, part], axis=-1, keepdims=True)
            pull[:, part] *= np.minimum(1, reach / np.maximum(length, 1e-12))
        travel = poses.motion(self._device, poses.moved(self._pose, pull))
        share = np.arange(1, self.ticks + 1)[:, None, None] / self.ticks
        devices = poses.moved(self._device, share * travel)
        path, wrenches = self.batch.run(devices)
        self._device, self._pose, self._wrench = devices[-1], path[-1], wrenches[-1]
        self._actions += 1

        distance = np.linalg.norm(self._pose[:, :3] - self.goal.pose[:3], axis=-1)
        inside = np.array([self.goal.contains(pose) for pose in self._pose])
        ms = self.ticks * 1000 / self.settings["rate"]
        self._held = np.where(inside, self._held + ms, 0)
        terminated = inside & (self._held > self.goal.hold_ms)
        truncated = ~terminated & (self._actions >= self.max_actions)
        reward = (self._distance - distance) / self._first + terminated
        self._distance = distance
        force = np.linalg.norm(wrenches[..., :3], axis=-1)
        info = {
            "distance_mm": distance,
            "seated": terminated,
            "force_N": force[-1],
            "max_force_N": force.max(axis=0),
            "actions": self._actions.copy(),
        }
        return self._observe(), reward, terminated, truncated, info

    def _observe(self) -> Observation:
        return {"pose": self._pose.copy(), "goal": self._goal.copy(), "wrench": self._wrench.copy()}


class Insertion:
    """Put the tool of a scene where its goal is, with the signatures of a Gymnasium environment.

    Observation: a dict with pose (7,) of the tool, goal (7,) as it is observed, wrench (6,) on the hand. Action (6,): the
    motion of the device in the next `ticks` ticks, mm and rad on the axes of the scene, within action_space; larger ones
    are cut. Reward: the share of the way to the goal that the action covered, and 1 when the tool is seated, which ends
    the episode. The same seed and actions give the same bits. Options: see InsertionBatch.
    """

    metadata: Mapping[str, Any] = {"render_modes": []}
    render_mode = None
    spec = None

    def __init__(self, scene: str | os.PathLike[str] | SceneFile = "peg-h7", **options: Any) -> None:
        self._task = InsertionBatch(scene, 1, threads=1, **options)
        self.observation_space = self._task.observation_space
        self.action_space = self._task.action_space
        self._seeds = np.random.default_rng()

    @property
    def unwrapped(self) -> Insertion:
        return self

    @property
    def scene(self) -> SceneFile:
        return self._task.scene

    def reset(self, *, seed: int | None = None, options: Mapping[str, Any] | None = None) -> tuple[Observation, dict[str, Any]]:
        """Begins an episode. seed: determines it and, if the next reset() has none, all later ones."""
        if seed is not None:
            self._seeds = np.random.default_rng(seed)
        episode = int(self._seeds.integers(2**63))
        return _single(self._task.reset([episode])), {"episode": episode}

    def step(self, action: ArrayLike) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Observation, reward, terminated, truncated, info: distance_mm, seated, force_N, max_force_N of the action."""
        observation, reward, terminated, truncated, info = self._task.act(np.asarray(action, float)[None])
        single = {key: value[0].item() for key, value in info.items()}
        return _single(observation), float(reward[0]), bool(terminated[0]), bool(truncated[0]), single

    def render(self) -> None:
        """Nothing: `touchstone run` draws scenes."""

    def close(self) -> None:
        """Nothing is open."""


def _single(observation: Observation) -> Observation:
    return {key: value[0] for key, value in observation.items()}
