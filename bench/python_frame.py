"""What a frame through Python costs beside the same frame in C++: set a time, read the points of the first mesh into an array.

  PYTHONPATH=build/python python3 bench/python_frame.py RIG CLIP [FRAMES] [--program build/bench_face] [--rounds 9]

Medians over the frames of a round; the sides take turns, and the median round is told.
"""
import argparse
import statistics
import subprocess
import time

import numpy as np

import kpsa


def python_frame(rig, clip, frames):
    """Microseconds of the median frame."""
    scene = rig.scene()
    scene.play(clip)
    mesh = rig.meshes[0]
    (playing,) = [c for c in rig.clips if c.name == clip]  # again and again
    out = np.empty((mesh.vertices, 3), np.float32)
    times = []
    for frame in range(-(frames // 10), frames):  # the first ones warm up
        begin = time.perf_counter_ns()
        scene.set_time(playing.begin + abs(frame) / rig.fps % (playing.end - playing.begin))
        scene.points(mesh.name, out)
        end = time.perf_counter_ns()
        if frame >= 0:
            times.append((end - begin) / 1000)
    return statistics.median(times)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rig")
    parser.add_argument("clip")
    parser.add_argument("frames", type=int, nargs="?", default=400)
    parser.add_argument("--program", default="build/bench_face")
    parser.add_argument("--rounds", type=int, default=9)
    options = parser.parse_args()
    rig = kpsa.load(options.rig)
    python, native = [], []
    for _ in range(options.rounds):
        ran = subprocess.run([options.program, options.rig, options.clip, str(options.frames)], check=True, capture_output=True, text=True)
        native.append(float(ran.stdout))
        python.append(python_frame(rig, options.clip, options.frames))
    difference = statistics.median(p - n for p, n in zip(python, native))
    print(f"C++ {statistics.median(native):.1f} us a frame, Python {statistics.median(python):.1f} us: {difference:+.1f} us "
          f"(rounds from {min(p - n for p, n in zip(python, native)):+.1f} to {max(p - n for p, n in zip(python, native)):+.1f})")


if __name__ == "__main__":
    main()
