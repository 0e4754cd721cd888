"""Evaluates character rigs: YAML on glTF characters, exactly or by trained subspaces.

    import kpsa
    rig = kpsa.load("hello.yaml")
    scene = rig.scene()
    scene.set("upper.rotateZ", -60)
    xyz = scene.points("column")  # float32 [V, 3], world space, metres
"""
from ._kpsa import (BenchReport, Clip, Connection, Control, Error, GraphEdit, Library, Mesh, Node, Plug, Problem, Rig, Scene,
                    TrainingReport, Verdict, __version__)

__all__ = ["BenchReport", "Clip", "Connection", "Control", "Error", "GraphEdit", "Library", "Mesh", "Node", "Plug", "Problem", "Rig",
           "Scene", "TrainingReport", "Verdict", "load"]


def load(path, *, variant=None, fps=None, plugins=True, trust=()):
    """A rig (.yaml) or a character (.glb, .gltf, .vrm), with the standard node types.

    trust: folders besides the rig's own whose files it may name.
    """
    return Library().load(str(path), variant=variant, fps=fps, plugins=plugins, trust=[str(folder) for folder in trust])
