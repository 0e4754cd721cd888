"""How far each control of a rig moves its vertices, from one end of its range to the other.

    python3 what_a_control_moves.py RIG [-o controls.png]
"""
import argparse

import numpy as np

import kpsa


def reach(rig):
    """By control: the share of vertices that it moves by more than a micrometre, and the farthest, metres."""
    scene = rig.scene()
    found = {}
    for control in rig.controls:
        ends = []
        for value in (control.min, control.max):
            scene.set(control.name, value)
            ends.append([scene.points(mesh.name) for mesh in rig.meshes])
        scene.set(control.name, control.value)
        moved = np.concatenate([np.linalg.norm(a - b, axis=1) for a, b in zip(*ends)])
        found[control.name] = ((moved > 1e-6).mean(), moved.max())
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("rig")
    parser.add_argument("-o", "--output", default="controls.png")
    arguments = parser.parse_args()
    found = reach(kpsa.load(arguments.rig))
    for name, (share, farthest) in found.items():
        print(f"{name:30} {100 * share:5.1f} % of the vertices, at most {1000 * farthest:.1f} mm")

    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    figure, axes = pyplot.subplots(figsize=(8, 0.6 + 0.25 * len(found)), layout="constrained")
    axes.barh(list(found), [1000 * farthest for _, farthest in found.values()])
    axes.invert_yaxis()
    axes.set(xlabel="mm, the farthest vertex")
    figure.savefig(arguments.output, dpi=150)


if __name__ == "__main__":
    main()
