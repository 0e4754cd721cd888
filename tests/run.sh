#!/bin/sh
# Builds everything and runs all tests, and again under the address and undefined-behaviour sanitizers.
set -e
cd "$(dirname "$0")/.."
sh cmake/dependencies.sh
cmake -S . -B build -G Ninja -DCMAKE_BUILD_TYPE=Release -DKPSA_UNITY=ON > /dev/null
cmake --build build
ctest --test-dir build --output-on-failure -j "$(nproc)"
sh tests/sanitize.sh
