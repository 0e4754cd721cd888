#!/bin/sh
# docs/howto/training.md does what it says: train.sh SOURCE PROGRAM WORK
set -e
source=$1 work=$3
PATH=$(dirname "$2"):$PATH
rm -rf "$work"
mkdir -p "$work"
cp "$source/scenes/hello/hello.glb" "$work/CHAR.glb"
cd "$work"
sh "$source/examples/train/train.sh" CHAR.glb > said.txt || { cat said.txt; exit 1; }
cat said.txt
grep -q "char.kpsa: 794 points, [1-9][0-9]* cues" said.txt
grep -q "promise  *kept" said.txt
grep -q "frame 12 of wave" said.txt
test -s char.npz
