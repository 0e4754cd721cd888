#!/usr/bin/env python3
"""Errors over the frames of a bench, as a figure: what kpsa bench --json printed of subspaces trained with --keep-modes.

    kpsa bench RIG --json > bench.json
    python3 bench/plot_frames.py bench.json -o errors.svg    # or .png, .pdf; needs Debian's python3-matplotlib

A row for each subspace. Left: every frame reconstructed, hit or not, and what its error is made of: what no coordinates in the
subspace can reach (projection), and the measured coordinates against the best ones (cueing). Right: what SoftCache shows, and the
tolerance.
"""
import argparse
import json
import math
import sys
from pathlib import Path

ANY = 1e29  # metres: a tolerance that accepts every frame
UNITS = [("um", 1e6, 1e-4), ("mm", 1e3, 1.0), ("m", 1.0, math.inf)]  # name, in a metre, lengths below which it is used


def plotted(document):
    """The sides that have errors by frame; of one subspace the one with a tolerance, if there is any."""
    sides = [side for side in [document, *document["beside"]] if side["frame_errors"] is not None]
    strict = {side["subspace"] for side in sides if side["tolerance"] < ANY}
    return [side for side in sides if side["tolerance"] < ANY or side["subspace"] not in strict]


def counted(count, word):
    return f"{count:,} {word}" + ("" if count == 1 else "s")


def title(side):
    paper = side["mode"] == "paper"
    text = f"{Path(side['rig']).stem}, {side['clip']}: {'paper mode' if paper else 'default'}, "
    text += counted(side["cue_points"], "key point" if paper else "point")
    scalars = side["cues"] - side["cue_points"]
    return text + (f", {counted(scalars, 'scalar')}" if scalars else "")


def unit_of(lengths):
    largest = max((length for length in lengths if length is not None and math.isfinite(length)), default=0)
    return next((name, factor) for name, factor, below in UNITS if largest < below)


def scaled(values, factor):
    return [math.nan if value is None else factor * value for value in values]


def draw_parts(axes, side, frames):
    errors = side["frame_errors"]
    percent = 100 / side["error"]["bbox_diagonal"]
    for key, color, width in (("total", "#303030", 1.8), ("projection", "#2f7fd0", 1.2), ("cueing", "#e08a1a", 1.2)):
        axes.plot(frames, scaled(errors[key], percent), color=color, linewidth=width, label=key)
    axes.set(title=title(side), ylabel="RMS error, % of the diagonal")


def draw_shown(axes, side, frames):
    largest = [frame["max"] for frame in side["per_frame"]]
    tolerance = side["tolerance"] if side["tolerance"] < ANY else None
    name, factor = unit_of([*largest, tolerance])
    axes.plot(frames, scaled(largest, factor), color="#208050", linewidth=1.2, label="largest error of a point")
    axes.plot(frames, scaled([frame["rms"] for frame in side["per_frame"]], factor), color="#303030", linewidth=1.2, label="RMS")
    if tolerance is not None:
        axes.axhline(factor * tolerance, color="#c03030", linestyle="--", linewidth=1.2, label="tolerance")
    misses = [frame for frame, missed in zip(frames, side["frame_errors"]["miss"]) if missed]
    if misses:
        axes.plot(misses, [0] * len(misses), "|", color="#b0208a", markersize=9, clip_on=False, label=f"misses, {len(misses)} of {len(frames)}")
    hits = 100 * side["hit_rate"]
    axes.set(title=f"with SoftCache: {hits:.1f} % hit" if tolerance is not None else "all frames accepted", ylabel=f"error, {name}")


def figure_of(document, pyplot):
    sides = plotted(document)
    if not sides:
        raise ValueError("no side has errors by frame: kpsa train --keep-modes keeps what they need")
    figure, rows = pyplot.subplots(len(sides), 2, figsize=(11, 2.9 * len(sides)), squeeze=False, layout="constrained")
    for side, (left, right) in zip(sides, rows):
        frames = range(len(side["frame_errors"]["total"]))
        draw_parts(left, side, frames)
        draw_shown(right, side, frames)
        for axes in (left, right):
            axes.set_xlim(0, max(1, len(frames) - 1))
            axes.set_ylim(bottom=0, top=1.28 * axes.get_ylim()[1])  # room for the legend
            axes.set_xlabel("frame")
            axes.grid(color="#e4e4e8", linewidth=0.7)
            axes.set_axisbelow(True)
            axes.spines[["top", "right"]].set_visible(False)
            axes.legend(loc="upper right", ncols=4, frameon=False, fontsize="small", handlelength=1.4, columnspacing=1.2)
    return figure


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bench", help="what kpsa bench --json printed")
    parser.add_argument("-o", "--output", required=True, help="the figure: .svg, .png or .pdf")
    arguments = parser.parse_args()
    try:
        document = json.loads(Path(arguments.bench).read_text())
        if document["schema"] != "kpsa.bench/1":
            raise ValueError("its schema is not kpsa.bench/1")
    except OSError as error:
        sys.exit(f"{arguments.bench}: {error.strerror}")
    except (ValueError, KeyError, TypeError) as error:
        sys.exit(f"{arguments.bench}: is no bench of this version: {error}")

    try:
        import matplotlib
    except ImportError:
        sys.exit("matplotlib is missing: apt-get install python3-matplotlib, and run this with /usr/bin/python3")
    matplotlib.use("Agg")
    # The same bytes for the same numbers, and letters as letters
    matplotlib.rcParams.update({"svg.hashsalt": "kpsa", "svg.fonttype": "none", "font.size": 9, "axes.titlesize": 10})
    from matplotlib import pyplot

    try:
        figure = figure_of(document, pyplot)
    except (ValueError, KeyError, TypeError) as error:
        sys.exit(f"{arguments.bench}: {error}")
    figure.savefig(arguments.output, dpi=120, metadata={"Date": None} if arguments.output.endswith(".svg") else None)


if __name__ == "__main__":
    main()
