#!/bin/sh
# Other programs read what kpsa eval writes: the Khronos validator, three.js, and Blender where it is there.
#   caches.sh SOURCE PROGRAM WORK
here=$1/tests/caches kpsa=$2 work=$3
for program in node npm; do
  command -v $program > /dev/null || { echo "skipped: there is no $program here"; exit 77; }
done
rm -rf "$work"
mkdir -p "$work" && cd "$work" && cp "$here"/*.mjs "$here"/*.json "$here/.npmrc" "$1/viewer/tests/support/npz.mjs" . || exit 1
# A registry that cannot be reached, or lacks a package, is no fault of the caches; anything else is
npm ci --loglevel=error > npm.log 2>&1 || {
  cat npm.log
  grep -qE 'ENOTFOUND|ECONNREFUSED|ETIMEDOUT|ECONNRESET|EAI_AGAIN|E403|E404|403 Forbidden|404 Not Found' npm.log || exit 1
  echo "skipped: npm cannot reach what package-lock.json names"
  exit 77
}
set -e
for name in hello face; do
  for output in glb npz; do
    "$kpsa" eval "$1/scenes/$name/$name.yaml" --frames 0:24 -o $name.$output -q
  done
  node check_glb.mjs $name.glb $name.npz
done
# What joints and morph targets alone move
for name in hello/hello face/face gi/room; do
  of=skinned_$(basename $name)
  "$kpsa" eval "$1/scenes/$name.glb" --frames 0:24 -o $of.glb --skinned -q
  "$kpsa" eval "$1/scenes/$name.glb" --frames 0:24 -o $of.npz -q
  node check_glb.mjs $of.glb $of.npz --skinned
done
"$kpsa" eval "$1/scenes/hello/hello.yaml" --frames 0:24 -o hello.usda -q
command -v blender > /dev/null || { echo "without Blender, which is not here"; exit 0; }
blender --background --python-exit-code 1 --python "$here/check_blender.py" -- hello.glb hello.usda hello.npz skinned_face.glb skinned_face.npz > blender.log 2>&1 ||
  { cat blender.log; exit 1; }
grep -E "^(Blender [0-9].*:|skipped)" blender.log
grep -q "Blender has read all caches" blender.log
