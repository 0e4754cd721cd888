#!/bin/sh
# Builds everything and runs all tests. tests/sanitize.sh does the same under sanitizers, which takes three times as long.
set -e
cd "$(dirname "$0")/.."
sh cmake/dependencies.sh
cmake -S . -B build -G Ninja -DCMAKE_BUILD_TYPE=Release -DKPSA_UNITY=ON > /dev/null
cmake --build build
ctest --test-dir build --output-on-failure -j "$(nproc)"
