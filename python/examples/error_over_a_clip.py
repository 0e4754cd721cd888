"""How far an accelerated rig is from the exact one, frame after frame.

    python3 error_over_a_clip.py RIG CLIP [-o error.png]
"""
import argparse

import numpy as np

import kpsa


def errors(rig, clip):
    """Frame times, and the largest distance of a vertex in each frame, metres."""
    (length,) = [c.end for c in rig.clips if c.name == clip]
    seconds = np.arange(int(length * rig.fps) + 1) / rig.fps
    frames = []
    for side in (rig, rig.accelerated()):
        scene = side.scene()
        scene.play(clip)
        frames.append(scene.frames(seconds))
    full, fast = frames
    largest = np.max([np.linalg.norm(full[m.name] - fast[m.name], axis=2).max(axis=1) for m in rig.meshes], axis=0)
    return seconds, largest, fast["verdicts"]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("rig")
    parser.add_argument("clip")
    parser.add_argument("-o", "--output", default="error.png")
    arguments = parser.parse_args()
    seconds, largest, verdicts = errors(kpsa.load(arguments.rig), arguments.clip)
    print(f"{verdicts['hit'].sum()} of {len(seconds)} frames hit, largest error {1000 * largest.max():.3f} mm")

    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    figure, axes = pyplot.subplots(figsize=(8, 3), layout="constrained")
    axes.plot(seconds, 1000 * largest, label="largest error of a vertex")
    axes.plot(seconds[~verdicts["hit"]], 1000 * largest[~verdicts["hit"]], "x", label="no hit")
    axes.set(xlabel="seconds", ylabel="mm", title=f"{arguments.clip}, accelerated against exact")
    axes.legend()
    figure.savefig(arguments.output, dpi=150)


if __name__ == "__main__":
    main()
