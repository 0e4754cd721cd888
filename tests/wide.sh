#!/bin/sh
# Builds the kernels and their tests for 64-bit ARM, runs them there in an emulator, and compares the bits of every
# kernel with those of build/test_nodes: vector units of another kind have to agree, too. It installs nothing. On
# Debian 12 it needs the packages g++-aarch64-linux-gnu, qemu-user and libgtest-dev, and libraries of the other kind
# unpacked in a folder, FOLDER (build-arm64/root if none is given), for instance with
#   sudo dpkg --add-architecture arm64 && sudo apt-get update
#   for p in libhwy1 libhwy-dev libfmt9 libtbb12 libembree3-3; do apt-get download $p:arm64; done
#   for d in *_arm64.deb; do dpkg -x $d FOLDER; done
# Usage: sh tests/wide.sh [FOLDER]
set -e
cd "$(dirname "$0")/.."
out=build-arm64
root=$(cd "${1:-$out/root}" 2>/dev/null && pwd) || root=""
missing=""
for tool in aarch64-linux-gnu-g++ qemu-aarch64; do
  command -v $tool > /dev/null || missing="$missing $tool"
done
[ -f /usr/src/googletest/googletest/src/gtest-all.cc ] || missing="$missing /usr/src/googletest"
for library in hwy fmt tbb embree3; do
  ls "$root"/usr/lib/aarch64-linux-gnu/lib$library.so.* > /dev/null 2>&1 || missing="$missing lib$library.so(arm64)"
done
if [ -n "$missing" ]; then
  echo "missing:$missing" >&2
  sed -n '4,8s/^# //p' "$0" >&2
  exit 77
fi
[ -x build/test_nodes ] || { echo "build/test_nodes is what the bits are compared with: build it first" >&2; exit 1; }

# Headers of other libraries are the same for both kinds, but for Highway's none has to know
mkdir -p $out/include
for headers in hwy fmt tbb oneapi embree3 eigen3/Eigen; do ln -sfn "/usr/include/$headers" "$out/include/$(basename $headers)"; done
# Highway compiles for NEON with AES: what surrounds its code has to allow as much, or constructors are not inlined
flags="-std=c++20 -O2 -march=armv8-a+crypto -Wno-restrict -DNDEBUG -ffp-contract=off -fno-math-errno -DFMT_SHARED -DHWY_SHARED_DEFINE -DHWY_COMPILE_ALL_ATTAINABLE \
-DHWY_DISABLED_TARGETS=HWY_SVE|HWY_SVE2|HWY_SVE_256|HWY_SVE2_128 -I. -isystem $out/include -isystem /usr/src/googletest/googletest/include \
-isystem /usr/src/googletest/googletest -Wall -Wextra -Werror"
sources="$(ls base/*.cpp nodes/kernels/*.cpp | grep -v nodes/kernels/expression) $(ls tests/nodes/kernels_*_test.cpp) \
tests/nodes/driver_frames_test.cpp /usr/src/googletest/googletest/src/gtest-all.cc /usr/src/googletest/googletest/src/gtest_main.cc"
for source in $sources; do
  echo "$source $out/$(echo "$source" | tr / _).o"
done | xargs -P "$(nproc)" -n 2 sh -c 'exec aarch64-linux-gnu-g++ '"'$(echo "$flags" | sed "s/ /' '/g")'"' -c "$0" -o "$1"'
aarch64-linux-gnu-g++ -o $out/test_kernels $out/*.o -L"$root/usr/lib/aarch64-linux-gnu" -l:libhwy.so.1 -l:libfmt.so.9 -l:libtbb.so.12 \
  -l:libembree3.so.3 -Wl,--allow-shlib-undefined

qemu-aarch64 -L /usr/aarch64-linux-gnu -E LD_LIBRARY_PATH="$root/usr/lib/aarch64-linux-gnu" \
  $out/test_kernels --gtest_output=xml:$out/wide.xml --gtest_brief=1
build/test_nodes --gtest_filter='KernelLaw.EveryVectorUnit*' --gtest_output=xml:$out/here.xml --gtest_brief=1 > /dev/null
for xml in here wide; do grep -o '<property name="[^/]*/>' $out/$xml.xml > $out/$xml.bits; done
[ -s $out/here.bits ] || { echo "no bits were recorded" >&2; exit 1; }
if ! cmp -s $out/here.bits $out/wide.bits; then
  echo "kernels whose bits differ:" >&2
  diff $out/here.bits $out/wide.bits >&2
  exit 1
fi
echo "the bits of $(wc -l < $out/here.bits) kernels are the same on both"
