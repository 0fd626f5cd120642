# Models a peg and its block in Blender, and writes what docs/first-parts.md uses:
#   blender --background --python docs/examples/first_parts.py -- FOLDER
#
# peg.stl and block.stl: the parts, in assembled position, in millimeters, +z up.
# first-parts.glb: both, marked by custom properties, with a goal and a demonstration.
import math
import os
import sys

import bpy

folder = sys.argv[sys.argv.index("--") + 1]
SIDES = 64
MM = 0.001


def turned(name, profile):
    """A solid of revolution about z; profile: (radius, z) in mm from the lower end of the axis to the upper one."""
    vertices, rings = [], []
    for radius, z in profile:
        if radius == 0:
            rings.append([len(vertices)])
            vertices.append((0, 0, z * MM))
        else:
            rings.append(range(len(vertices), len(vertices) + SIDES))
            for k in range(SIDES):
                angle = 2 * math.pi * k / SIDES
                vertices.append((radius * MM * math.cos(angle), radius * MM * math.sin(angle), z * MM))
    faces = []
    for low, high in zip(rings, rings[1:]):
        for k in range(SIDES):
            n = (k + 1) % SIDES
            corners = [low[k % len(low)], low[n % len(low)], high[n % len(high)], high[k % len(high)]]
            faces.append(list(dict.fromkeys(corners)))
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    part = bpy.data.objects.new(name, mesh)
    bpy.context.collection.objects.link(part)
    return part


bpy.ops.wm.read_factory_settings(use_empty=True)
# A peg of 10 mm with a knob; its tip at z = -25 mm has a chamfer of 1 mm.
peg = turned("peg", [(0, -25), (4, -25), (5, -24), (5, 10), (9, 12), (9, 24), (7, 26), (0, 26)])
# A round block, 40 mm wide, with a blind hole of 10.4 mm, 25.5 mm deep.
block = turned("block", [(0, -35), (20, -35), (20, 0), (6.2, 0), (5.2, -1), (5.2, -25.5), (0, -25.5)])

for part in (peg, block):
    bpy.ops.object.select_all(action="DESELECT")
    part.select_set(True)
    bpy.ops.export_mesh.stl(filepath=os.path.join(folder, part.name + ".stl"), use_selection=True, global_scale=1 / MM)

# The same as a marked scene: custom properties of the objects and of the scene.
peg["touchstone_role"] = "tool"
peg["touchstone_outcome_seated"] = True
block["touchstone_role"] = "obstacle"
goal = bpy.data.objects.new("goal", None)
bpy.context.collection.objects.link(goal)
goal["touchstone_role"] = "goal"
goal["touchstone_goal_depth_m"] = 0.025
goal["touchstone_goal_tolerance_m"] = 0.0005
bpy.context.scene["touchstone_settings_stiffness"] = 1.0
# The demonstration: keyframes of the tool, from 35 mm above down into the hole, then a second at the goal.
fps = bpy.context.scene.render.fps
for seconds, height in ((0, 35), (0.5, 35), (3.5, 0), (5, 0)):
    peg.location = (0, 0, height * MM)
    peg.keyframe_insert("location", frame=round(seconds * fps))
bpy.context.scene.frame_start = 0
bpy.context.scene.frame_end = 5 * fps
bpy.ops.export_scene.gltf(filepath=os.path.join(folder, "first-parts.glb"), export_extras=True)
