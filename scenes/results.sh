#!/bin/sh
# Results: characters that nobody tuned for, and those of the reference's sizes in paper mode and as the program chooses, with
# a rigger's stack and with a heavy one, on three clips each. Builds
# kpsa, trains, benches the sides of a character in one run, draws (plots with matplotlib), and writes docs/results.md and docs/results/. What it makes on
# the way goes to out/results/.
#
#   sh scenes/results.sh [--assets FOLDER]   everything, some 20 to 30 minutes; with human.glb, head.glb, Fox.glb and
#                                            robot.glb of a folder among those that nobody tuned for
#   sh scenes/results.sh --try KPSA FOLDER   the same steps with that program on the smallest rig, all files to FOLDER
set -e
cd "$(dirname "$0")/.."
train_options='' bench_options='--runs 9 --idle'
default_options='' assets=''
if [ "$1" = --try ]; then
  kpsa=$2 docs=$3 work=$3/out
  train_options='--samples 100 --calibration 60' bench_options='--runs 1 --idle'
  default_options='--rows 24'
else
  if [ "$1" = --assets ]; then assets="--assets $2"; fi
  kpsa=build/kpsa docs=docs work=out/results
  sh cmake/dependencies.sh python3-matplotlib
  echo '== building kpsa (minutes, the first time)'
  cmake -S . -B build -G Ninja -DCMAKE_BUILD_TYPE=Release -DKPSA_UNITY=ON > /dev/null
  cmake --build build --target kpsa bench_untouched
fi
python=/usr/bin/python3 # Debian's, which has its packages
[ -x "$python" ] || python=python3
mkdir -p "$docs/results" "$work"

# train RIG NAME OPTIONS...: a subspace of scenes/RIG.yaml to NAME.kpsa.
train() {
  rig=scenes/$1.yaml to=$work/$2.kpsa
  shift 2
  # shellcheck disable=SC2086
  "$kpsa" train "$rig" --keep-modes -q --force -o "$to" "$@" $train_options
}

# bench RIG NAME OPTIONS...: all sides take turns with the full evaluation; NAME.json.
bench() {
  rig=scenes/$1.yaml to=$work/$2.json
  shift 2
  # shellcheck disable=SC2086
  "$kpsa" bench "$rig" -q --json "$@" $bench_options > "$to"
  "$kpsa" report "$to"
}

# sides RIG NAME OPTIONS...: paper mode accepting every frame, and with SoftCache; the default.
sides() {
  of=$1 name=$2 to=$3
  shift 3
  bench "$of" "$to" --kpsa "$work/$name-paper.kpsa" --tolerance any --kpsa "$work/$name-paper.kpsa" --tolerance own \
    --kpsa "$work/$name.kpsa" --tolerance own "$@"
}

# plot NAME: errors over the frames of NAME.json.
plot() {
  if "$python" -c 'import matplotlib' 2> /dev/null; then
    "$python" bench/plot_frames.py "$work/$1.json" -o "$docs/results/$1.svg"
  else
    echo "skipped: no plots, as $python has no matplotlib (Debian: python3-matplotlib)"
  fi
}

# measure RIG KEY_POINTS [CLIP...]: trains both modes, and benches them on the test clip and on these, which nobody looked at
# before their rows are printed.
measure() {
  of=$1 name=$(basename "$1") points=$2
  shift 2
  printf '\n== %s: training\n' "$name"
  train "$of" "$name-paper" --paper --key-points "$points"
  # shellcheck disable=SC2086
  train "$of" "$name" $default_options
  printf '\n== %s: full, paper mode and default mode taking turns\n' "$name"
  sides "$of" "$name" "$name"
  plot "$name"
  for clip in "$@"; do sides "$of" "$name" "$name-$clip" --clip "$clip"; done
}

# draw RIG CLIP FRAMES SCALE SIZE: full, key points, accelerated, error; paper mode with every frame accepted, and default mode.
draw() {
  name=$(basename "$1") rig=scenes/$1.yaml
  set -- --clip "$2" --frames "$3" --error-scale "$4" --size "$5" -q --force
  "$kpsa" render "$rig" --kpsa "$work/$name-paper.kpsa" --tolerance any "$@" -o "$docs/results/$name-paper.png"
  "$kpsa" render "$rig" --kpsa "$work/$name.kpsa" "$@" -o "$docs/results/$name.png"
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

# clips STACK: what was reached on the two clips that nobody looked at, of the characters with that stack.
clips() {
  printf '\n`emotions`:\n\n'
  "$kpsa" report "$work/boy$1-emotions.json" "$work/car$1-emotions.json" "$work/animal$1-emotions.json" --without-any | sed '/^$/,$d'
  printf '\n`scene`, `race` and `sniff`:\n\n'
  "$kpsa" report "$work/boy$1-scene.json" "$work/car$1-race.json" "$work/animal$1-sniff.json" --without-any | sed '/^$/,$d'
}

if [ "$1" = --try ]; then
  characters=hello/hello heavy=hello/hello
  measure hello/hello 10 wave
  draw hello/hello wave 0:24:24 1mm 40x50
  "$kpsa" report "$work/hello.json" --without-any > "$work/main.md"
  "$kpsa" report "$work/hello-wave.json" --without-any | sed '/^$/,$d' > "$work/clips.md"
  "$kpsa" report "$work/hello.json" --reference 1x > "$work/heavy.md"
  cp "$work/clips.md" "$work/heavy-clips.md"
  echo 'Not part of a trial.' > "$work/untouched.md"
else
  characters='boy/boy car/car animal/animal' heavy='boy/boy_heavy car/car_heavy animal/animal_heavy'
  printf '\n== characters that nobody tuned for\n'
  # shellcheck disable=SC2086
  build/bench_untouched --keep "$work" --markdown $assets > "$work/untouched.md" || [ $? = 1 ] # a promise broken, which the table says
  for stack in '' _heavy; do
    measure "boy/boy$stack" 170 emotions scene
    measure "car/car$stack" 70 emotions race
    measure "animal/animal$stack" 80 emotions sniff
  done
  # The tolerance in the middle of the scale
  draw boy/boy talk 40 0.8mm 480x600
  draw car/car talk 40 4mm 560x600
  draw animal/animal talk 40 0.8mm 480x600
  "$kpsa" report "$work/boy.json" "$work/car.json" "$work/animal.json" --without-any > "$work/main.md"
  "$kpsa" report "$work/boy_heavy.json" "$work/car_heavy.json" "$work/animal_heavy.json" \
    --reference 8.7x --reference 15x --reference 20.75x > "$work/heavy.md"
  clips '' > "$work/clips.md"
  clips _heavy > "$work/heavy-clips.md"
fi

processor=$(sed -n 's/^model name[^:]*: *//p' /proc/cpuinfo 2> /dev/null | head -n 1)
{
  cat << END
# Results

Written by \`sh scenes/results.sh --assets FOLDER\`. All settings but the rigs' tolerances are the program's own.

## Characters that nobody tuned for

\`kpsa init\`, \`train\` and \`bench\` with nothing changed. The first three are made from a seed by \`build/bench_untouched\`
([benchmarks.md](benchmarks.md) says how), the others are files of that folder. *Held-out hits* are of the trainer's own new poses that are made of the training clips, *predicted* is the
speedup that \`train\` tells, *misses included* the one of the test clip, its largest accepted error is in tolerances. *Memory* is the most that training takes at once.

END
  cat "$work/untouched.md"
  cat << END

## At the sizes of the reference

M. Meyer and J. Anderson, *Key Point Subspace Acceleration and Soft Caching* (SIGGRAPH 2007); its slides give:

| character | points | key points | speedup |
| --- | ---: | ---: | ---: |
| Dash | 2,986 | 170 | 8.7x |
| McQueen | 2,625 | 70 | 15x |
| Ratatouille | 4,150 | 80 | 20.75x |

Below are three characters of this project with as many points, each with two stacks: one as a rigger builds it, shapes with in-betweens
and combinations, shapes that correct poses, one wrap, a skin, wires, soft places, clusters and a deltaMush; and a heavy one. *Paper
mode* is the method of the slides with as many key points: varimax modes, two key points each, least squares, SoftCache by the
residual at the key points. The *default* chooses what to measure, points (three numbers each), scalars and products of these, before
a deltaMush or at any other place of the graph, and how many. All store their reconstruction alike, in tiles and reduced precision,
and took turns with the full evaluation in one run.

- Full: the same program, every optimisation on; nothing of it is slowed down. Its cost stands below in nanoseconds a point, and what
  it is spent on. All deformers here run in SIMD floats.
- Full cost within it: deformers that make less than the tolerance in the clip cost, and show nothing. \`bench --idle\` switches each one off
  on 48 frames of the clip, and then, the one that makes least first, as many together as keep within the tolerance: the share is of what is then
  not evaluated. A speedup of 1 / (1 - share) can be had by leaving them out.
- Speedup of hits: full against accelerated time of the accepted frames. For *all frames accepted* these are all
  frames, as in the slides; with a tolerance those that SoftCache accepts. Of all frames: misses included.
- Ceiling: full against what is left where cues, projection and reconstruction take no time at all: the graph that the
  subspace reads, and later stages. *With reconstruction*: where cues and projection take none, but the reconstruction what it
  takes here, at the speed of the memory; where this stands below the reference's speedup, no choice of key points reaches that.
  The slides name the time to pose what is measured as the bound: *graph* and *cues* below. A few points run through all
  steps of the stack, which cost something each however few the points are.
- RMS, max: final points against the full evaluation, all points of all frames of the test clip, misses included (they are exact),
  in % of the diagonal of the box around them. The test clips are not trained on.
- Times are medians of the CPU time of one thread (${processor:-unknown}; [benchmarks.md](benchmarks.md) says how it is measured); they
  vary with the machine, and so do speedups and ceilings; the other columns do not.

## The three characters

The clip is \`talk\`. A key point behind a deltaMush needs all points around it, so key points of the output drag in much of the mesh: paper
mode has no advantage here. The default measures before it, and where that does not tell enough, a few points behind it, too
(docs/decisions/15-worst-output-points-as-cues.md), or it stands for the points before the mush's last step and runs that itself, of all (the car)
or of those that need it (docs/decisions/27-points-before-the-last-step.md, 36-last-steps-of-single-points.md): its error is then no longer split.

END
  cat "$work/main.md"
  cat << END

The last table has RMS over all frames, each reconstructed, hit or not: *projection* is what no coordinates in the subspace can
reach, *cueing* the coordinates that the measurements give against the best ones, *storage* what tiles and reduced precision add
outside of the subspace; total² = projection² + cueing² up to storage. For the default mode these are its own, more, modes.

## Other clips

The same subspaces. \`emotions\` goes from one expression of the whole face to the next. The third clip of each is written by hand
(\`scenes/keyed_clips.cpp\`): a scene of the boy, a race, a scent that the animal follows. None of them is trained on, and nothing was chosen
by the third.

END
  cat "$work/clips.md"
  cat << END

## Heavy stacks

The rigs \`scenes/*/*_heavy.yaml\`: three proximityWraps and a wrap, three lattices, squash, bends and a twist, and no
deltaMush. The reference's stacks cost what they cost in 2007; these were chosen with its ratios in sight: a stack that costs tens of nanoseconds
a point leaves less to save than one that costs microseconds.

END
  cat "$work/heavy.md"
  printf '\nOn the other clips:\n\n'
  cat "$work/heavy-clips.md"
  cat << END

## Pictures

A frame of the test clip; errors are coloured up to twice the tolerance, where the arrow is. Plots, by \`bench/plot_frames.py\`: on the left all frames reconstructed, hit or not, and what their error
is made of; on the right what SoftCache shows.
END
  for rig in $characters; do pictures "$rig" "$(basename "$rig")"; done
  if [ "$heavy" != "$characters" ]; then
    printf '\n### Errors with heavy stacks\n\n'
    for rig in $heavy; do echo "![$(basename "$rig"): errors over the frames](results/$(basename "$rig").svg)"; done
  fi
} > "$docs/results.md"
printf '\n%s has the results.\n' "$docs/results.md"
