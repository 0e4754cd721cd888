#!/bin/sh
# Makes the seeds of the corpora that are no text anew, with the programs of a build: sh tests/fuzz/seeds.sh [build]
set -e
cd "$(dirname "$0")/../.."
build=${1:-build}
corpus=tests/fuzz/corpus
cmake --build "$build" --target fuzz_seeds kpsa
"$build/tests/fuzz/fuzz_seeds" $corpus
cp tests/rigs/nodes/doll.gltf tests/rigs/nodes/plate.gltf $corpus/gltf
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cp $corpus/gltf/strip.glb "$folder"
cat > "$folder/strip.yaml" <<'RIG'
kpsa: 1
character: strip.glb
nodes:
  mush: {type: deltaMush, iterations: 8}
deform:
  - {meshes: [strip], stack: [skin, mush]}
controls:
  tip.rotateZ: {min: -75, max: 30}
  root.rotateX: {min: -30, max: 30}
accelerate:
  strip: {points: [strip@mush], tolerance: 1mm, train: {samples: 60}}
RIG
train() { "$build/kpsa" train "$folder/strip.yaml" --force -q --calibration 20 -o "$corpus/subspace/$1.kpsa" $2 > /dev/null; }
mkdir -p $corpus/subspace  # version*.kpsa there are of earlier versions, which nobody writes any more
train map "--modes 4 --rows 9"
train modes "--modes 3 --rows 9 --keep-modes"
train paper "--paper --key-points 4 --modes 4"
