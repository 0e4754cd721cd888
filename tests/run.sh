#!/bin/sh
# Builds everything and runs all tests, and those of the engine and of its readers again under the address and
# undefined-behaviour sanitizers (tests/sanitize.sh has the rest).
set -e
cd "$(dirname "$0")/.."
sh cmake/dependencies.sh
# For the sanitized build, and for tests of the Python module, of the page and of completions; it takes as long as a good part of the build
sh cmake/dependencies.sh clang libclang-rt-14-dev blender chromium zsh fish &
others=$!
cmake -S . -B build -G Ninja -DCMAKE_BUILD_TYPE=Release -DKPSA_UNITY=ON -DKPSA_TESTS_BY_ROOM=ON > /dev/null
cmake --build build
wait $others || echo "Blender, Chromium or shells could not be installed: their tests are skipped"
# One more than processors: tests wait for programs and browsers a quarter of the time
ctest --test-dir build --output-on-failure -j "$(($(nproc) + 1))"
# Tests within a process that said that they are skipped, and why
awk '/: Skipped$/ {getline why} /^\[  SKIPPED \] .* ms\)$/ {print $4 " was skipped: " why}' build/Testing/Temporary/LastTest.log
sh tests/sanitize.sh asan engine
