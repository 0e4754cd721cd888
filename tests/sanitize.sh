#!/bin/sh
# Builds the program and its tests under sanitizers and runs the tests there:
#   sh tests/sanitize.sh [asan|tsan [most|engine|all]]
# asan, the address and undefined-behaviour sanitizers, if nothing is given; tsan: the thread sanitizer. Tests that measure what
# sanitizers change (KPSA_NATIVE in CMakeLists.txt) are left out, and long trainings, but with `all`. `engine` is the third of it
# that every run of all tests has (tests/run.sh): the rooms up to rig/, which read what others wrote and evaluate it, and
# the fuzzers' corpora, subspaces among them. Clang, since it
# compiles sanitized code four times faster than GCC, and since a second compiler sees what the first does not. kpsa is a
# folder of another project's there (examples/embed), so that what add_subdirectory makes of it is built and run, too.
set -e
cd "$(dirname "$0")/.."
which=${1:-asan} part=${2:-most} all=OFF
case "$which $part" in
  "asan most" | "tsan most" | "asan engine" | "tsan engine") ;;
  "asan all" | "tsan all") all=ON ;;
  *)
    echo "tests/sanitize.sh: expected [asan|tsan [most|engine|all]], found \"$*\"" >&2
    exit 2
    ;;
esac
sh cmake/dependencies.sh clang libclang-rt-14-dev
if [ "$which" = tsan ]; then
  folder=build-tsan sanitizer=KPSA_TSAN
  export TSAN_OPTIONS="halt_on_error=1 suppressions=$PWD/tests/tsan.supp"
else
  folder=build-asan sanitizer=KPSA_SANITIZE
fi
sh tests/package/whole.sh . $folder/project
cmake -S $folder/project -B $folder -G Ninja -DCMAKE_CXX_COMPILER=clang++ -DCMAKE_BUILD_TYPE=None -DCMAKE_CXX_FLAGS="-O1 -g0" \
  -D$sanitizer=ON -DKPSA_COMPILE_ONCE=ON -DKPSA_PROGRAM=ON -DKPSA_SANITIZE_ALL=$all > /dev/null
if [ "$part" = engine ]; then
  rooms="base graph nodes files gltf rig fuzz"
  cmake --build $folder --target $(printf 'test_%s ' $rooms)
  ctest --test-dir $folder/kpsa --no-tests=error --output-on-failure -j "$(($(nproc) + 1))" -R "^test_($(echo $rooms | tr ' ' '|'))\$"
  exit
fi
cmake --build $folder
ctest --test-dir $folder/kpsa --output-on-failure -j "$(($(nproc) + 1))"
sh tests/package/embed.sh . $folder $folder/embedded
