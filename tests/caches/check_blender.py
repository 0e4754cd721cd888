"""Run by Blender: blender --background --python-exit-code 1 --python check_blender.py -- GLB USDA NPZ SKINNED_GLB SKINNED_NPZ

Blender imports all, and its evaluated meshes have the points of the .npz, in its own axes and at three frames.
"""
import sys

import bpy
import numpy as np

if not hasattr(np, "bool"):
    np.bool = bool  # which the importer of Blender 3.4 asks of NumPy before 1.24

glb, usda, npz, skinned_glb, skinned_npz = sys.argv[sys.argv.index("--") + 1 :]


def check(kind, npz, first_frame, tolerance):
    arrays = np.load(npz)
    times = arrays["times"]
    frames = [arrays[key] for key in arrays.files if key != "times"]
    diagonal = np.linalg.norm(np.ptp(np.concatenate([f.reshape(-1, 3) for f in frames]), axis=0))
    # The importer draws bones with a mesh of its own, in a collection that is not shown
    objects = [o for o in bpy.context.scene.objects if o.type == "MESH" and not o.name.startswith("Icosphere")]
    if len(objects) > 1:
        objects = [next(o for o in objects if o.name.split(".")[0] == key[:-2]) for key in arrays.files if key != "times"]
    assert len(objects) == len(frames), f"{kind}: {len(objects)} meshes"
    worst = 0
    for t in (0, len(times) // 2, len(times) - 1):
        frame = first_frame + times[t] * 24
        bpy.context.scene.frame_set(int(frame), subframe=frame - int(frame))
        for found, expected in zip(objects, frames):
            mesh = found.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
            points = np.empty(3 * len(mesh.vertices))
            mesh.vertices.foreach_get("co", points)
            points = points.reshape(-1, 3) @ np.array(found.matrix_world)[:3, :3].T + np.array(found.matrix_world)[:3, 3]
            assert len(points) == expected.shape[1], f"{kind}: {len(points)} vertices"
            x, y, z = expected[t].T
            worst = max(worst, np.linalg.norm(points - np.stack([x, -z, y], 1), axis=1).max())
            assert len(mesh.materials) > 0 and mesh.materials[0] is not None, f"{kind}: no material"
            if hasattr(mesh, "calc_normals_split"):  # Blender before 4.1
                mesh.calc_normals_split()
            normals = np.empty(3 * len(mesh.loops))
            mesh.loops.foreach_get("normal", normals)
            lengths = np.linalg.norm(normals.reshape(-1, 3), axis=1)
            assert (abs(lengths - 1) < 1e-3).all(), f"{kind}: normals of length {lengths.min()}"
    print(f"Blender {bpy.app.version_string}, {kind}: within {worst / diagonal:.1e} of the diagonal")
    assert worst <= tolerance * diagonal, f"{kind}: {worst} m off"


def empty():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.render.fps = 24


empty()
bpy.ops.import_scene.gltf(filepath=glb)
check("glb", npz, 0, 1.01e-4)
empty()
bpy.ops.import_scene.gltf(filepath=skinned_glb)
check("glb with joints", skinned_npz, 0, 1.1e-5)
if bpy.app.build_options.usd:
    empty()
    bpy.ops.wm.usd_import(filepath=usda)
    check("usda", npz, 0, 1e-6)
else:
    print("skipped: usda, this Blender is built without USD")
print("Blender has read all caches")
