#!/bin/sh
# Light after bounces, learnt and measured: trains scenes/gi/gi.yaml, prints the table of its test clip frame by frame, and writes
# pictures (full, accelerated, error) of three of its frames. From the project's root, after the build: sh scenes/gi/results.sh
# [kpsa] [folder]
set -e
kpsa=${1:-build/kpsa}
out=${2:-out/gi}
mkdir -p "$out"
"$kpsa" train scenes/gi/gi.yaml -o "$out/gi.kpsa" --force | tee "$out/train.txt"
"$kpsa" bench scenes/gi/gi.yaml --kpsa "$out/gi.kpsa" --frames 0:24:4 --runs 1 --per-frame | tee "$out/bench.txt"
for layer in all indirect; do
  "$kpsa" render scenes/gi/gi.yaml --kpsa "$out/gi.kpsa" --clip slow --camera front --frames 2:22:10 --layer $layer -o "$out/$layer.png" --force
done
# A lamp that swings farther than it ever did in training: a miss, which names it, and the full picture
"$kpsa" bench scenes/gi/gi.yaml --kpsa "$out/gi.kpsa" --clip slow --frames 0:8:8 --runs 1 --set lampArm.rotateZ=70 | tee "$out/lamp.txt"
