"""Recordings of the program as arrays."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._core import Settings, _recorded_scene, run
from ._scene import Scene, bundled_folder


class Recording:
    """A folder that `touchstone run --record` or run(record=...) wrote.

    ticks: all ticks, an array (n,) whose columns `touchstone export --fields` explains, mapped from the file without a
    copy. notes: the rest of the recording, a dict. scene: the scene's file, or the folder that holds it; by default it
    is found in the recording's folder, beside it, where it was, or among the bundled scenes. The content decides.
    """

    def __init__(self, folder: str | os.PathLike[str], scene: str | os.PathLike[str] = "") -> None:
        self.folder = Path(folder)
        self._named = os.fspath(scene)
        try:
            self.notes: dict[str, Any] = json.loads((self.folder / "recording.json").read_text("utf-8"))
            self.ticks: NDArray[np.void] = np.load(self.folder / "ticks.npy", mmap_mode="r")
        except (OSError, ValueError) as error:
            raise ValueError(
                f"'{self.folder}' is no recording that can be read ({error}): give the folder of a recording, or repair "
                f"it with 'touchstone recover'"
            ) from error

    def __len__(self) -> int:
        return len(self.ticks)

    def __repr__(self) -> str:
        return f"<Recording '{self.folder}', {len(self)} ticks>"

    def poses(self, of: str = "tool") -> NDArray[np.float64]:
        """Poses (n, 7) of the tool, of the device (as the tick used it) or the input (as it came)."""
        units = ("x_mm", "y_mm", "z_mm", "qw", "qx", "qy", "qz")
        return np.stack([self.ticks[f"{of}_{unit}"] for unit in units], axis=-1)

    def wrenches(self) -> NDArray[np.float64]:
        """Wrenches (n, 6) on the hand about the tool's origin, as the tick computed them."""
        names = [f"force_o_{k}_N" for k in "xyz"] + [f"torque_o_{k}_mNm" for k in "xyz"]
        return np.stack([self.ticks[name] for name in names], axis=-1)

    @property
    def tool_pose(self) -> dict[str, Any]:
        """The last pose of the tool as a motion of its file: see Scene.tool_pose."""
        return self.scene.tool_pose(self.poses()[-1])

    @property
    def scene(self) -> Scene:
        """The scene that was recorded. Raises SceneError if its file is gone, ValueError if none is named."""
        try:
            os.fspath(self.notes["scene"]["file"])
        except (KeyError, TypeError) as error:
            raise ValueError(f"{self.folder / 'recording.json'}: 'scene' names no file: open the scene yourself") from error
        return Scene(_recorded_scene(self.folder, self._named, bundled_folder() or ""))

    def replay(self, settings: Settings | None = None) -> dict[str, Any]:
        """Repeats the recording by its inputs and compares all ticks: see Run.replay. With other settings they differ."""
        replayed: dict[str, Any] = run(self.scene, f"replay:{self.folder}", settings).replay
        return replayed
