#!/bin/sh
# Builds kpsa, trains the bundled face, and shows it evaluated fully and accelerated. Everything it writes goes to out/.
set -e
cd "$(dirname "$0")/.."
sh cmake/dependencies.sh
cmake -S . -B build -G Ninja -DCMAKE_BUILD_TYPE=Release > /dev/null
cmake --build build --target kpsa
mkdir -p out
build/kpsa train scenes/face/face.yaml -o out/face.kpsa --rows 96 --force
build/kpsa bench scenes/face/face.yaml --kpsa out/face.kpsa
build/kpsa render scenes/face/face.yaml --kpsa out/face.kpsa -o out/face.png --force
echo
echo "out/face.png shows the face fully evaluated, accelerated, and the error between the two."
