#!/bin/sh
# Builds everything under the address and undefined-behaviour sanitizers and runs all tests there.
set -e
cd "$(dirname "$0")/.."
sh cmake/dependencies.sh
cmake -S . -B build-asan -G Ninja -DCMAKE_BUILD_TYPE=None -DCMAKE_CXX_FLAGS="-O1 -g1" -DKPSA_SANITIZE=ON > /dev/null
cmake --build build-asan
ctest --test-dir build-asan --output-on-failure -j "$(nproc)"
