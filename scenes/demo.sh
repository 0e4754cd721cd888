#!/bin/sh
# Builds kpsa, trains the bundled face, and shows it evaluated fully and accelerated. Everything it writes goes to out/.
set -e
cd "$(dirname "$0")/.."
sh cmake/dependencies.sh
echo "== building kpsa (minutes, the first time)"
cmake -S . -B build -G Ninja -DCMAKE_BUILD_TYPE=Release -DKPSA_UNITY=ON > /dev/null
cmake --build build --target kpsa
mkdir -p out
printf '\n== training on the face (half a minute)\n'
build/kpsa train scenes/face/face.yaml -o out/face.kpsa --force
printf '\n== full against accelerated, on a clip that it was not trained on\n'
build/kpsa bench scenes/face/face.yaml --kpsa out/face.kpsa
printf '\n== drawing\n'
build/kpsa render scenes/face/face.yaml --clip talk --kpsa out/face.kpsa -o out/face.png --force
printf '\nout/face.png shows the face fully evaluated, what is measured of it, accelerated, and the error between the two.\n'
