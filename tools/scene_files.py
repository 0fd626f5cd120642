"""What scene files say, for the scripts beside this module."""
import json
import struct


def read(scene):
    """The JSON of a glTF file."""
    data = scene.read_bytes()
    if data[:4] == b"glTF":
        data = data[20:20 + struct.unpack_from("<I", data, 12)[0]]
    return json.loads(data)


def motions_of(scene):
    """Names of the scene's animations."""
    return [motion["name"] for motion in read(scene).get("animations", []) if motion.get("name")]
