#!/bin/sh
# Trains a character and plays it accelerated, with `kpsa` among the programs: train.sh CHAR.glb
set -e
kpsa init "$1" -o char.yaml                       # a starter rig: controls ranged from the clips, stack [gltf, mush]
kpsa train char.yaml                              # poses, subspace, cues, calibration: writes char.kpsa
kpsa bench char.yaml                              # how fast, how wrong, how often, on clips that were not trained on
kpsa eval char.yaml --accelerate -o char.npz      # every frame of the first clip
kpsa explain char.yaml --accelerate --frame 12    # a hit, a blend or a miss, and why
