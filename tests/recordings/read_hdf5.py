"""Checks what h5py reads from an exported file of twice the same recording:  read_hdf5.py DIR HDF5"""
import json
import sys

import h5py
import numpy as np

folder, name = sys.argv[1:]
ticks = np.load(folder + "/ticks.npy")
file = h5py.File(name)
data = file["data"]
assert sorted(data.keys()) == ["demo_0", "demo_1"] and data.attrs["total"] == 2 * len(ticks)
environment = json.loads(data.attrs["env_args"])
assert environment["env_name"] == "hello" and environment["type"] == 2, environment
assert environment["env_kwargs"]["settings"]["stiffness"] == "1"


def columns(*names):
    return np.stack([ticks[name] for name in names], axis=1)


def same(a, b):
    return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()


def pose(part):
    return [f"{part}_{axis}_mm" for axis in "xyz"] + [f"{part}_q{axis}" for axis in "wxyz"]


for demo in data.values():
    assert demo.attrs["num_samples"] == len(ticks) and demo.attrs["scene"] == "hello.gltf"
    assert demo["recording.json"][()].tobytes() == open(folder + "/recording.json", "rb").read()
    assert same(demo["ticks"][:], ticks)
    assert same(demo["obs/device_pose"][:], columns(*pose("device")))
    assert same(demo["obs/tool_pose"][:], columns(*pose("tool")))
    wrench = columns(*[f"force_o_{axis}_N" for axis in "xyz"], *[f"torque_o_{axis}_mNm" for axis in "xyz"])
    assert same(demo["obs/wrench"][:], wrench) and same(demo["wrench"][:], wrench)
    assert same(demo["obs/rows"][:], columns("rows"))
    actions = demo["actions"][:]
    assert actions.shape == (len(ticks), 6) and not actions[-1].any()
    assert same(actions[:-1, :3].copy(), np.diff(columns(*pose("device")[:3]), axis=0))
    assert demo["dones"][:].nonzero()[0].tolist() == [len(ticks) - 1]
    assert demo["rewards"].shape == (len(ticks),) and not demo["rewards"][:].any()  # hello has no goal
    assert np.allclose(demo["t_ms"][:], np.arange(len(ticks)))
    assert demo["chain"].dtype == np.uint64 and len(set(demo["chain"][:])) == len(ticks)
    assert demo["obs/tool_pose"].attrs["help"].endswith("tool_x_mm, tool_y_mm, tool_z_mm, tool_qw, tool_qx, tool_qy, tool_qz")
scene, = (entry for entry in json.loads(file["manifest.json"][()].tobytes())["files"])
assert file["files"][scene["scene"]]["hello.gltf"].shape == (scene["bytes"],)
assert "mask" not in file
