"""Finding scenes, and making them of arrays."""

from __future__ import annotations

import difflib
import functools
import json
import os
import struct
from pathlib import Path
from typing import Any, Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._core import SceneError, SceneFile

_PACKAGE = Path(__file__).resolve().parent
# In a package of pip's, in a build folder, and as Debian's packages install it.
_FOLDERS = [_PACKAGE / "scenes", _PACKAGE.parent.parent / "scenes", Path("/usr/share/touchstone/scenes")]


def _scene_files(folder: Path) -> list[Path]:
    return sorted(file for file in folder.glob("*.gl*") if file.suffix in (".glb", ".gltf"))


def bundled_folder() -> Path | None:
    """The folder of the bundled scenes, or None."""
    return next((folder for folder in _FOLDERS if _scene_files(folder)), None)


def _bundled() -> dict[str, Path]:
    folder = bundled_folder()
    return {file.stem: file for file in _scene_files(folder)} if folder else {}


def scenes() -> list[str]:
    """Names of the bundled scenes."""
    return list(_bundled())


def find_scene(scene: str | os.PathLike[str]) -> Path:
    """The file of a bundled scene, or the path itself if it is a file. Raises SceneError, which names the nearest scene."""
    if os.path.isfile(scene):
        return Path(scene)
    bundled = _bundled()
    name = os.fspath(scene)
    if name in bundled:
        return bundled[name]
    near = difflib.get_close_matches(name, bundled, 1)
    raise SceneError(
        f"there is no scene '{name}': "
        + (f"did you mean '{near[0]}'?" if near else "give the path of a .glb or .gltf file, or one of " + ", ".join(bundled))
    )


class Scene(SceneFile):
    """A glTF scene that is ready to run.

    Scene("bunnies"), of scenes(), or Scene("parts.glb"). leaves: maximum number of leaves of every sphere tree, in place
    of the scene's. trees: build sphere trees now; otherwise they are built when settings first need them.
    """

    def __init__(self, scene: str | os.PathLike[str], *, leaves: int = 0, trees: bool = False) -> None:
        super().__init__(os.fspath(find_scene(scene)), leaves=leaves, trees=trees)
        self._options = {"leaves": leaves, "trees": trees}

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickled by the path of its file, which the reader opens again."""
        return functools.partial(Scene, **self._options), (os.path.abspath(self.file),)


def _node(name: str, pose: ArrayLike | None, extras: Mapping[str, Any]) -> dict[str, Any]:
    node: dict[str, Any] = {"name": name, "extras": {"touchstone": dict(extras)}}
    if pose is not None:
        node.update(_place(pose, name))
    return node


def _require_poses(poses: NDArray[np.float64], name: str) -> None:
    if not np.isfinite(poses).all() or (np.abs(np.linalg.norm(poses[..., 3:], axis=-1) - 1) > 1e-3).any():
        raise ValueError(f"{name} needs finite x, y, z in mm and quaternions qw, qx, qy, qz of length 1")


def _plain(value: Any) -> Any:
    """For json: NumPy's numbers and arrays as Python's."""
    if isinstance(value, (np.generic, np.ndarray)):
        return value.tolist()
    raise TypeError(f"a key of a scene cannot hold a {type(value).__name__}")


def _place(pose: ArrayLike, name: str) -> dict[str, Any]:
    p = np.asarray(pose, float)
    if p.shape != (7,):
        raise ValueError(f"{name}: a pose has the shape (7,), not {p.shape}")
    _require_poses(p, f"the pose of {name}")
    return {"translation": (p[:3] / 1000).tolist(), "rotation": [*p[4:].tolist(), float(p[3])]}


def write_scene(
    file: str | os.PathLike[str],
    tool: tuple[ArrayLike, ArrayLike],
    obstacles: Mapping[str, tuple[ArrayLike, ArrayLike]],
    *,
    start: ArrayLike | None = None,
    poses: Mapping[str, ArrayLike] | None = None,
    goal: ArrayLike | None = None,
    goal_keys: Mapping[str, Any] | None = None,
    demonstration: tuple[ArrayLike, ArrayLike] | None = None,
    keys: Mapping[str, Mapping[str, Any]] | None = None,
) -> Path:
    """Writes a .glb of meshes from arrays, for Scene() and for the program.

    tool, and each of obstacles by its name: vertices (n, 3) in mm and triangles (m, 3), counter-clockwise seen from
    outside. start, poses: where they stand, (7,); by default at the origin. goal: where the tool should end, (7,), with
    goal_keys such as tolerance_m. demonstration: times (k,) in ms and poses (k, 7). keys: more keys of docs/scenes.md
    for the part of a name ("tool" for the tool), as {"tool": {"staticFriction": 0.5, "dynamicFriction": 0.4}}.
    Coordinates are stored as glTF stores them, in single precision. Returns the path.
    """
    file = Path(file)
    if file.suffix != ".glb":
        raise ValueError(f"{file}: give the file a name that ends in .glb")
    wrong = next((name for name in obstacles if not isinstance(name, str) or not name), None)
    if wrong is not None:
        raise ValueError(f"the name of an obstacle must be a text that is not empty, not {wrong!r}")
    if goal_keys and goal is None:
        raise ValueError("goal_keys needs a goal: give its pose as goal")
    if "tool" in obstacles:
        raise ValueError("an obstacle cannot have the name 'tool'")
    binary = bytearray()
    gltf: dict[str, Any] = {
        "asset": {"version": "2.0", "generator": "touchstone.write_scene"},
        "scene": 0,
        "scenes": [{"nodes": []}],
        "nodes": [],
        "meshes": [],
        "accessors": [],
        "bufferViews": [],
    }

    def accessor(values: np.ndarray[Any, Any], kind: str, bounds: bool) -> int:
        component = 5125 if values.dtype == np.uint32 else 5126
        gltf["bufferViews"].append({"buffer": 0, "byteOffset": len(binary), "byteLength": values.nbytes})
        entry: dict[str, Any] = {
            "bufferView": len(gltf["bufferViews"]) - 1,
            "componentType": component,
            "count": len(values),
            "type": kind,
        }
        if bounds:
            flat = values.reshape(len(values), -1)
            entry.update(min=flat.min(axis=0).tolist(), max=flat.max(axis=0).tolist())
        binary.extend(values.tobytes())
        gltf["accessors"].append(entry)
        return len(gltf["accessors"]) - 1

    def part(name: str, mesh: tuple[ArrayLike, ArrayLike], role: str, pose: ArrayLike | None) -> None:
        vertices = np.ascontiguousarray(np.asarray(mesh[0], float) / 1000, np.float32)
        corners = np.asarray(mesh[1])
        if vertices.ndim != 2 or vertices.shape[1] != 3 or corners.ndim != 2 or corners.shape[1] != 3:
            raise ValueError(f"{name}: a mesh is vertices (n, 3) and triangles (m, 3)")
        if len(corners) == 0 or not np.issubdtype(corners.dtype, np.integer) or corners.min() < 0 or corners.max() >= len(vertices):
            raise ValueError(f"{name}: triangles must be whole numbers below the number of vertices, and not none")
        if not np.isfinite(vertices).all():
            raise ValueError(f"{name}: vertices must be finite")
        primitive = {
            "attributes": {"POSITION": accessor(vertices, "VEC3", True)},
            "indices": accessor(np.ascontiguousarray(corners, np.uint32).reshape(-1), "SCALAR", False),
        }
        gltf["meshes"].append({"primitives": [primitive]})
        node = _node(name, pose, {"role": role, **(keys or {}).get(name, {})})
        node["mesh"] = len(gltf["meshes"]) - 1
        gltf["nodes"].append(node)

    unknown = (set(poses or {}) - set(obstacles)) | (set(keys or {}) - set(obstacles) - {"tool"})
    if unknown:
        raise ValueError(f"there is no part '{sorted(unknown, key=str)[0]}'")
    part("tool", tool, "tool", start)
    for name, mesh in obstacles.items():
        part(name, mesh, "obstacle", (poses or {}).get(name))
    if goal is not None:
        gltf["nodes"].append(_node("goal", goal, {"role": "goal", "goal": dict(goal_keys or {})}))
    if demonstration is not None:
        times, path = np.asarray(demonstration[0], float), np.asarray(demonstration[1], float)
        if times.ndim != 1 or path.shape != (len(times), 7):
            raise ValueError("a demonstration is times (k,) in ms and poses (k, 7)")
        if not len(times) or not np.isfinite(times).all() or times[0] < 0 or (np.diff(times) <= 0).any():
            raise ValueError("the times of a demonstration must be finite, from 0 and ascending")
        _require_poses(path, "a demonstration")
        at = accessor(np.ascontiguousarray(times / 1000, np.float32), "SCALAR", True)
        where = accessor(np.ascontiguousarray(path[:, :3] / 1000, np.float32), "VEC3", False)
        turned = accessor(np.ascontiguousarray(path[:, [4, 5, 6, 3]], np.float32), "VEC4", False)
        gltf["animations"] = [
            {
                "name": "demonstration",
                "samplers": [{"input": at, "output": where}, {"input": at, "output": turned}],
                "channels": [
                    {"sampler": 0, "target": {"node": 0, "path": "translation"}},
                    {"sampler": 1, "target": {"node": 0, "path": "rotation"}},
                ],
            }
        ]
    gltf["scenes"][0]["nodes"] = list(range(len(gltf["nodes"])))
    gltf["buffers"] = [{"byteLength": len(binary)}]
    try:
        text = json.dumps(gltf, ensure_ascii=False, allow_nan=False, default=_plain).encode()
    except (TypeError, ValueError) as error:
        raise ValueError(f"keys and goal_keys must be texts, truth values, finite numbers, and lists and dicts of them: {error}") from error
    text += b" " * (-len(text) % 4)
    binary.extend(b"\0" * (-len(binary) % 4))
    size = 12 + 8 + len(text) + 8 + len(binary)
    whole = struct.pack("<4sII", b"glTF", 2, size) + struct.pack("<I4s", len(text), b"JSON") + text
    whole += struct.pack("<I4s", len(binary), b"BIN\0") + bytes(binary)
    partial = file.with_name(file.name + ".part")
    try:
        partial.write_bytes(whole)
        partial.replace(file)
    finally:
        partial.unlink(missing_ok=True)
    return file
