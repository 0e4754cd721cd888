#!/bin/sh
# Tests that take minutes each, on a release build: trainings of 2,000 controls and of 200,000 points.
set -e
cd "$(dirname "$0")/.."
sh cmake/dependencies.sh
cmake -S . -B build -G Ninja -DCMAKE_BUILD_TYPE=Release -DKPSA_UNITY=ON > /dev/null
cmake --build build --target test_cli
KPSA_LONG_TESTS=1 build/test_cli --gtest_filter='Corners.*'
