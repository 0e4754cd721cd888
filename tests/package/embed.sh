#!/bin/sh
# What examples/embed says of the bundled column.
#   embed.sh SOURCE FOLDER-OF-THE-PROGRAMS WORK
set -e
programs=$(cd "$2" && pwd)
mkdir -p "$3"
cp "$1/scenes/hello/hello.yaml" "$1/scenes/hello/hello.glb" "$3"
cd "$3"
"$programs/embed" hello.yaml upper.rotateZ -60 wave > said.txt
cat said.txt
rm embed.kpsa
grep -q "upper.rotateZ = -60 moves [1-9][0-9]* of [1-9][0-9]* vertices of column" said.txt
grep -q "wave: [1-9][0-9]* of 25 frames hit" said.txt
"$programs/look" | grep -q "^[1-9][0-9]* vertices, the first at -*[0-9]"
# Errors reach the program, with their places
if "$programs/embed" hello.yaml upper.rotatez -60 wave 2> error.txt; then exit 1; fi
grep -q "did you mean \"rotateZ\"" error.txt
