"""Run by Blender: blender --background --python-exit-code 1 --python blender_check.py -- RIG

The module is imported by Blender's own Python, and moves a mesh of its scene.
"""
import os
import sys

sys.path.insert(0, os.environ["KPSA_PYTHON_PATH"])

import bpy
import numpy as np

import kpsa

rig = kpsa.load(sys.argv[sys.argv.index("--") + 1])
scene = rig.scene()
(info,) = rig.meshes
mesh = bpy.data.meshes.new(info.name)
mesh.from_pydata(scene.points(info.name).tolist(), [], info.triangles.tolist())
bpy.context.collection.objects.link(bpy.data.objects.new(info.name, mesh))

rest = np.empty(3 * info.vertices, np.float32)
mesh.vertices.foreach_get("co", rest)
scene.set("upper.rotateZ", -60)
points = scene.points(info.name)
mesh.vertices.foreach_set("co", points.ravel())
mesh.update()
moved = np.empty_like(rest)
mesh.vertices.foreach_get("co", moved)
assert (moved == points.ravel()).all()
assert np.abs(moved - rest).max() > 0.01
print(f"Blender {bpy.app.version_string}: {info.vertices} vertices moved by kpsa {kpsa.__version__}")
