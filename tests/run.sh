#!/bin/sh
# Builds everything and runs all tests, then builds the program and the tests again under the address and
# undefined-behaviour sanitizers and runs them there. About 20 minutes on two cores.
set -e
cd "$(dirname "$0")/.."
sh cmake/dependencies.sh
cmake -S . -B build -G Ninja -DCMAKE_BUILD_TYPE=Release > /dev/null
cmake --build build
ctest --test-dir build --output-on-failure -j "$(nproc)"
sh tests/sanitize.sh
