#!/bin/sh
# A program of somebody else's against the installed package, static and shared, and a plugin against the installed headers.
#   package.sh SOURCE BUILD WORK
# Builds what is in examples/embed, copied out of the tree. With the sources of kpsa as a folder of its own it is built
# by tests/sanitize.sh, since all of kpsa is compiled for that; here that is configured only.
set -e
source=$1 build=$2 work=$3
rm -rf "$work"
mkdir -p "$work"
cmake --install "$build" --prefix "$work/installed" > /dev/null
cp -r "$source/examples/embed" "$work/program"
cd "$work"
for shared in OFF ON; do
  cmake -S program -B "program-$shared" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_PREFIX_PATH="$work/installed" -DBUILD_SHARED_LIBS=$shared > /dev/null
  cmake --build "program-$shared" > log.txt || { cat log.txt; exit 1; }
  sh "$source/tests/package/embed.sh" "$source" "program-$shared" "said-$shared"
done
cmp said-OFF/said.txt said-ON/said.txt

# What man and shells read
for file in man/man1/kpsa.1 bash-completion/completions/kpsa zsh/site-functions/_kpsa fish/vendor_completions.d/kpsa.fish; do
  grep -q accelerate "installed/share/$file"
done

# The plugin of the tests, against the headers that were installed
${CXX:-c++} -std=c++20 -fPIC -shared -I installed/include/kpsa/plugin "$source/tests/plugin/wobble.cpp" -o wobble.so
installed/bin/kpsa nodes wobble --plugin ./wobble.so | grep -q "A triangle wave."

# The sources as a folder
sh "$source/tests/package/whole.sh" "$source" whole
cmake -S whole -B whole-build -G Ninja -DCMAKE_BUILD_TYPE=Release > /dev/null
if ninja -C whole-build -t targets all | grep -q "test_\|bench_"; then
  echo "the tests of kpsa are part of another project's build"
  exit 1
fi
