#!/bin/sh
# The results of the reference with this project's characters: builds kpsa, trains paper mode and default mode, benches both
# in the same run, draws, and writes docs/results.md and docs/results/. What it makes on the way goes to out/results/.
#
#   sh scenes/results.sh                     everything, some ten minutes
#   sh scenes/results.sh --try KPSA FOLDER   the same steps with that program on the smallest rig, all files to FOLDER
set -e
cd "$(dirname "$0")/.."
train_options='' bench_options='--runs 9' render_options='--size 330x420'
if [ "$1" = --try ]; then
  kpsa=$2 docs=$3 work=$3/out
  train_options='--samples 100 --calibration 60' bench_options='--runs 1' render_options='--size 40x50'
else
  kpsa=build/kpsa docs=docs work=out/results
  sh cmake/dependencies.sh
  echo '== building kpsa (minutes, the first time)'
  cmake -S . -B build -G Ninja -DCMAKE_BUILD_TYPE=Release -DKPSA_UNITY=ON > /dev/null
  cmake --build build --target kpsa
fi
mkdir -p "$docs/results" "$work"

# "boy: 200 and 510, ...": how many numbers the default and paper mode measure; a key point is three.
numbers=''

# measure RIG KEY_POINTS ROWS: scenes/RIG.yaml in both modes; paper mode accepting every frame, and with SoftCache.
measure() {
  name=$(basename "$1") rig=scenes/$1.yaml
  numbers="$numbers${numbers:+, }$name: $3 and $((3 * $2))"
  printf '\n== %s: training\n' "$name"
  # shellcheck disable=SC2086
  "$kpsa" train "$rig" --paper --key-points "$2" --keep-modes -q --force -o "$work/$name-paper.kpsa" $train_options
  # shellcheck disable=SC2086
  "$kpsa" train "$rig" --rows "$3" --keep-modes -q --force -o "$work/$name.kpsa" $train_options
  printf '\n== %s: full, paper mode and default mode taking turns\n' "$name"
  # shellcheck disable=SC2086
  "$kpsa" bench "$rig" --kpsa "$work/$name-paper.kpsa" --tolerance any --kpsa "$work/$name-paper.kpsa" --tolerance own \
    --kpsa "$work/$name.kpsa" --tolerance own -q --json $bench_options > "$work/$name.json"
  "$kpsa" report "$work/$name.json"
  "$kpsa" report "$work/$name.json" --plot "$docs/results/$name.svg" --force
}

# draw RIG CLIP FRAMES SCALE: full, key points, accelerated, error; paper mode with every frame accepted, and default mode.
draw() {
  name=$(basename "$1") rig=scenes/$1.yaml
  # shellcheck disable=SC2086
  "$kpsa" render "$rig" --clip "$2" --frames "$3" --kpsa "$work/$name-paper.kpsa" --tolerance any --error-scale "$4" -q \
    --force -o "$docs/results/$name-paper.png" $render_options
  # shellcheck disable=SC2086
  "$kpsa" render "$rig" --clip "$2" --frames "$3" --kpsa "$work/$name.kpsa" --error-scale "$4" -q --force \
    -o "$docs/results/$name.png" $render_options
}

# pictures RIG TITLE: their part of the document.
pictures() {
  name=$(basename "$1")
  cat << END

### $2

![$name, paper mode: full, key points, accelerated, error](results/$name-paper.png)
![$name, default mode: full, what is measured, accelerated, error](results/$name.png)
![$name: errors over the frames](results/$name.svg)
END
}

if [ "$1" = --try ]; then
  characters=hello/hello variants=hello/hello
  measure hello/hello 10 24
  draw hello/hello wave 0:24:24 1mm
  "$kpsa" report "$work/hello.json" --reference 1x > "$work/main.md"
  cp "$work/main.md" "$work/mush.md"
else
  characters='boy/boy car/car animal/animal' variants='boy/boy_mush car/car_mush animal/animal_mush'
  measure boy/boy 170 200
  measure car/car 70 150
  measure animal/animal 80 200
  measure boy/boy_mush 170 200
  measure car/car_mush 70 150
  measure animal/animal_mush 80 240
  draw boy/boy talk 40 1mm
  draw car/car talk 40 10mm
  draw animal/animal talk 40 1mm
  "$kpsa" report "$work/boy.json" "$work/car.json" "$work/animal.json" \
    --reference 8.7x --reference 15x --reference 20.75x > "$work/main.md"
  "$kpsa" report "$work/boy_mush.json" "$work/car_mush.json" "$work/animal_mush.json" > "$work/mush.md"
fi

processor=$(sed -n 's/^model name[^:]*: *//p' /proc/cpuinfo 2> /dev/null | head -n 1)
{
  cat << END
# Results

Written by \`sh scenes/results.sh\`. The reference is M. Meyer and J. Anderson, *Key Point Subspace Acceleration and Soft
Caching* (SIGGRAPH 2007), whose slides give:

| character | points | key points | speedup |
| --- | ---: | ---: | ---: |
| Dash | 2,986 | 170 | 8.7x |
| McQueen | 2,625 | 70 | 15x |
| Ratatouille | 4,150 | 80 | 20.75x |

Below are three characters of this project with as many points. *Paper mode* is the method of the slides with as many key points:
varimax modes, two key points each, least squares, SoftCache by the residual at the key points. The *default* chooses what to
measure, points (three numbers each) and scalars, before a deltaMush or at any other place of the graph, and estimates all modes
from them. \`--rows\` says how many numbers; those of the default and of paper mode's key points are
$numbers.
Both store their reconstruction alike, in tiles and reduced precision, and both took turns with the full evaluation in one run.

- Full: the same program, every optimisation on; nothing of it is slowed down. Its cost stands below in nanoseconds a point. The
  reference's stacks cost what they cost in 2007; these are as heavy as we think a production's is, chosen with their cost in sight:
  layers of proximityWrap are most of it.
- Speedup of hits: full against accelerated time of the accepted frames. For *all frames accepted* these are all
  frames, as in the slides; with a tolerance those that SoftCache accepts. Of all frames: misses included.
- Ceiling: full against what is left where cues, projection and reconstruction take no time at all: the graph that the
  subspace reads, and later stages. *With reconstruction*: where cues and projection take none, but the reconstruction what it
  takes here, at the speed of the memory; where this stands below the reference's speedup, no choice of key points reaches that.
  The slides name the time to pose what is measured as the bound: *graph* and *cues* below. A stack that costs tens of
  nanoseconds a point leaves less to save than one that costs microseconds, and a few points run through all its steps, which
  cost something each however few the points are.
- RMS, max: final points against the full evaluation, all points of all frames of the test clip, misses included (they are exact),
  in % of the diagonal of the box around them. The test clips are not trained on.
- Times are medians of one core (${processor:-unknown}); they vary with the machine, and so do speedups and ceilings; the other
  columns do not.

## The three characters

END
  cat "$work/main.md"
  cat << END

The last table has RMS over all frames, each reconstructed, hit or not: *projection* is what no coordinates in the subspace can
reach, *cueing* the coordinates that the measurements give against the best ones, *storage* what tiles and reduced precision add
outside of the subspace; total² = projection² + cueing² up to storage. For the default mode these are its own, more, modes.

## With a deltaMush at the end

A key point behind a deltaMush needs all points around it, so few key points drag in much of the mesh: paper mode loses its
advantage wherever its speedup stands near 1 below. The default measures before it.

END
  cat "$work/mush.md"
  printf '\n## Pictures\n'
  for rig in $characters; do pictures "$rig" "$(basename "$rig")"; done
  if [ "$variants" != "$characters" ]; then
    printf '\n### Errors with a deltaMush\n\n'
    for rig in $variants; do echo "![$(basename "$rig"): errors over the frames](results/$(basename "$rig").svg)"; done
  fi
} > "$docs/results.md"
printf '\n%s has the results.\n' "$docs/results.md"
