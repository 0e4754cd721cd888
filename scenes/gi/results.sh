#!/bin/sh
# Light after bounces, learnt and measured: trains both entries of scenes/gi/gi.yaml (on pictures of 128 paths a pixel: an hour or so),
# prints the table of its test clip frame by frame, with the distances from light of 1,024 paths, writes pictures (full, accelerated,
# error) of three of its frames, and for the documents smaller ones of fewer paths: a sheet of training pictures, and test frames.
# From the project's root, after the build: sh scenes/gi/results.sh [kpsa] [folder] [documents' folder]
set -e
kpsa=${1:-build/kpsa}
out=${2:-out/gi}
docs=${3:-docs/results}
mkdir -p "$out" "$docs"
cp scenes/gi/gi.yaml scenes/gi/room.glb "$out/"
rig=$out/gi.yaml
for entry in light figure; do
  "$kpsa" train "$rig" --name $entry --force | tee "$out/train-$entry.txt"
done
"$kpsa" bench "$rig" --frames 0:24:4 --runs 1 --per-frame --reference converged --rival noisy | tee "$out/bench.txt"
for layer in all indirect; do
  "$kpsa" render "$rig" --accelerate --clip slow --camera front --frames 2:22:10 --layer $layer -o "$out/$layer.png" --force
done
# The documents' pictures: what is learnt of pictures of 16 paths, in minutes
few="--set bounced.samples=16 --set bounced.keySamples=0"
"$kpsa" train "$rig" --name light $few --force -q -o "$out/few.kpsa"
# Twelve of the 33 pictures of the training clip, as they are trained on
"$kpsa" render "$rig" $few --clip dance --camera front --times 0,.375,.75,1.125,1.5,1.875,2.125,2.5,2.875,3.25,3.625,4 \
  --shrink 3 -o "$docs/gi-training.png" --force
"$kpsa" render "$rig" $few --kpsa "$out/few.kpsa" --clip slow --camera front --frames 0:24:8 --shrink 2 -o "$docs/gi.png" --force
# A lamp that swings farther than it ever did in training: a miss, which names it, and the full picture
"$kpsa" bench "$rig" --clip slow --frames 0:8:8 --runs 1 --set lampArm.rotateZ=70 | tee "$out/lamp.txt"

# How many paths at how many key pixels: small pictures, since their noise a pixel is the same
small="--set bounced.width=40 --set bounced.height=40"
for keys in "8 200" "16 200" "32 200" "64 100"; do
  set -- $keys
  "$kpsa" train "$rig" --name light $small --set bounced.keySamples=$1 --key-points $2 --force -q -o "$out/small.kpsa"
  "$kpsa" bench "$rig" --kpsa "$out/small.kpsa" $small --set bounced.keySamples=$1 --frames 0:24:8 --runs 1 \
    --reference converged --rival noisy --per-frame -q | tee "$out/keys-$1-$2.txt"
done
