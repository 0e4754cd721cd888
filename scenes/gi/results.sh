#!/bin/sh
# Light after bounces, learnt and measured: trains scenes/gi/gi.yaml, prints the table of its test clip frame by frame, writes
# pictures (full, accelerated, error) of three of its frames, and for the documents small ones: a sheet of training pictures, and
# all frames of the table. From the project's root, after the build: sh scenes/gi/results.sh [kpsa] [folder] [documents' folder]
set -e
kpsa=${1:-build/kpsa}
out=${2:-out/gi}
docs=${3:-docs/results}
mkdir -p "$out" "$docs"
"$kpsa" train scenes/gi/gi.yaml -o "$out/gi.kpsa" --force | tee "$out/train.txt"
"$kpsa" bench scenes/gi/gi.yaml --kpsa "$out/gi.kpsa" --frames 0:24:4 --runs 1 --per-frame | tee "$out/bench.txt"
for layer in all indirect; do
  "$kpsa" render scenes/gi/gi.yaml --kpsa "$out/gi.kpsa" --clip slow --camera front --frames 2:22:10 --layer $layer -o "$out/$layer.png" --force
done
# Twelve of the 33 pictures of the training clip, as they are trained on
"$kpsa" render scenes/gi/gi.yaml --clip dance --camera front --times 0,.375,.75,1.125,1.5,1.875,2.125,2.5,2.875,3.25,3.625,4 \
  --shrink 3 -o "$docs/gi-training.png" --force
"$kpsa" render scenes/gi/gi.yaml --kpsa "$out/gi.kpsa" --clip slow --camera front --frames 0:24:4 --shrink 3 -o "$docs/gi.png" --force
# A lamp that swings farther than it ever did in training: a miss, which names it, and the full picture
"$kpsa" bench scenes/gi/gi.yaml --kpsa "$out/gi.kpsa" --clip slow --frames 0:8:8 --runs 1 --set lampArm.rotateZ=70 | tee "$out/lamp.txt"
