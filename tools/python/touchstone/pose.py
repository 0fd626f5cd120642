"""Poses and small motions as arrays. All functions take single poses (7,) and stacks (..., 7).

A motion is x, y, z (mm) and a rotation vector (rad), both on the axes of the scene, of shape (..., 6).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

IDENTITY: Array = np.array([0.0, 0, 0, 1, 0, 0, 0])


def _product(a: Array, b: Array) -> Array:
    """Product of quaternions qw, qx, qy, qz."""
    w = a[..., :1] * b[..., :1] - np.sum(a[..., 1:] * b[..., 1:], axis=-1, keepdims=True)
    v = a[..., :1] * b[..., 1:] + b[..., :1] * a[..., 1:] + np.cross(a[..., 1:], b[..., 1:])
    return np.concatenate([w, v], axis=-1)


def rotate(pose: ArrayLike, vectors: ArrayLike) -> Array:
    """Vectors (..., 3) of the part's frame on the axes of the scene."""
    q, v = np.asarray(pose, float)[..., 3:], np.asarray(vectors, float)
    t = 2 * np.cross(q[..., 1:], v)
    turned: Array = v + q[..., :1] * t + np.cross(q[..., 1:], t)
    return turned


def apply(pose: ArrayLike, points: ArrayLike) -> Array:
    """Points (..., 3) of the part's frame in the scene, mm."""
    placed: Array = rotate(pose, points) + np.asarray(pose, float)[..., :3]
    return placed


def inverse(pose: ArrayLike) -> Array:
    """X_BA of X_AB."""
    pose = np.asarray(pose, float)
    back: Array = np.concatenate([np.zeros_like(pose[..., :3]), pose[..., 3:] * [1, -1, -1, -1]], axis=-1)
    back[..., :3] = -rotate(back, pose[..., :3])
    return back


def compose(a: ArrayLike, b: ArrayLike) -> Array:
    """X_AC of X_AB and X_BC."""
    a, b = np.asarray(a, float), np.asarray(b, float)
    q = _product(*np.broadcast_arrays(a[..., 3:], b[..., 3:]))
    p = np.broadcast_to(apply(a, b[..., :3]), q.shape[:-1] + (3,))
    return np.concatenate([p, q / np.linalg.norm(q, axis=-1, keepdims=True)], axis=-1)


def exp(rotation: ArrayLike) -> Array:
    """The quaternion (..., 4) of a rotation vector (..., 3)."""
    rotation = np.asarray(rotation, float)
    half = np.linalg.norm(rotation, axis=-1, keepdims=True) / 2
    return np.concatenate([np.cos(half), np.sinc(half / np.pi) * rotation / 2], axis=-1)


def log(quaternion: ArrayLike) -> Array:
    """The shortest rotation vector (..., 3) of a quaternion (..., 4), rad."""
    q = np.asarray(quaternion, float)
    q = q * np.where(q[..., :1] < 0, -1.0, 1.0)
    sine = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    small = sine < 1e-9
    vector: Array = np.where(small, 2.0, 2 * np.arctan2(sine, q[..., :1]) / np.where(small, 1, sine)) * q[..., 1:]
    return vector


def moved(pose: ArrayLike, motion: ArrayLike) -> Array:
    """The pose after a motion (..., 6): its origin shifted, and turned about its origin."""
    pose, motion = np.asarray(pose, float), np.asarray(motion, float)
    q = _product(*np.broadcast_arrays(exp(motion[..., 3:]), pose[..., 3:]))
    p = np.broadcast_to(pose[..., :3] + motion[..., :3], q.shape[:-1] + (3,))
    return np.concatenate([p, q / np.linalg.norm(q, axis=-1, keepdims=True)], axis=-1)


def motion(start: ArrayLike, end: ArrayLike) -> Array:
    """The motion (..., 6) with moved(start, motion) = end."""
    start, end = np.asarray(start, float), np.asarray(end, float)
    turn = _product(*np.broadcast_arrays(end[..., 3:], start[..., 3:] * [1, -1, -1, -1]))
    return np.concatenate([np.broadcast_to(end[..., :3] - start[..., :3], turn.shape[:-1] + (3,)), log(turn)], axis=-1)
