#!/bin/sh
# examples/embed, copied out of the tree, with the sources of kpsa as a folder of its own: add_subdirectory instead of find_package.
#   whole.sh SOURCE FOLDER
set -e
source=$(cd "$1" && pwd) folder=$2
mkdir -p "$folder"
cp "$source"/examples/embed/*.cpp "$folder"
sed "s|^find_package(kpsa.*|add_subdirectory($source kpsa)|" "$source/examples/embed/CMakeLists.txt" > "$folder/CMakeLists.txt"
grep -q "^add_subdirectory" "$folder/CMakeLists.txt"
