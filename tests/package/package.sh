#!/bin/sh
# A program of somebody else's against the installed package, and against the sources as a folder of its own.
#   package.sh SOURCE BUILD WORK
# Builds what is in examples/embed, copied out of the tree. The sources as a folder are configured, and the program is
# compiled with them; to compile all of kpsa a second time would take as long as the build itself.
set -e
source=$1 build=$2 work=$3
rm -rf "$work"
mkdir -p "$work"
cmake --install "$build" --prefix "$work/installed" > /dev/null
cp -r "$source/examples/embed" "$work/program"
cp "$source/scenes/hello/hello.yaml" "$source/scenes/hello/hello.glb" "$work"
cd "$work"
for shared in OFF ON; do
  cmake -S program -B "program-$shared" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_PREFIX_PATH="$work/installed" -DBUILD_SHARED_LIBS=$shared > /dev/null
  cmake --build "program-$shared" > log.txt || { cat log.txt; exit 1; }
  "program-$shared/embed" hello.yaml upper.rotateZ -60 wave > "said-$shared.txt"
  cat "said-$shared.txt"
  rm embed.kpsa
  "program-$shared/look" | grep -q "^[1-9][0-9]* vertices, the first at -*[0-9]"
done
cmp said-OFF.txt said-ON.txt
grep -q "upper.rotateZ = -60 moves [1-9][0-9]* of [1-9][0-9]* vertices of column" said-ON.txt
grep -q "wave: [1-9][0-9]* of 25 frames hit" said-ON.txt

# Errors reach the program, with their places
if program-ON/embed hello.yaml upper.rotatez -60 wave 2> error.txt; then exit 1; fi
grep -q "did you mean \"rotateZ\"" error.txt

# What man and shells read
for file in man/man1/kpsa.1 bash-completion/completions/kpsa zsh/site-functions/_kpsa fish/vendor_completions.d/kpsa.fish; do
  grep -q accelerate "installed/share/$file"
done

# The plugin of the tests, against the headers that were installed
${CXX:-c++} -std=c++20 -fPIC -shared -I installed/include/kpsa/plugin "$source/tests/plugin/wobble.cpp" -o wobble.so
installed/bin/kpsa nodes wobble --plugin ./wobble.so | grep -q "A triangle wave."

# The sources as a folder
mkdir whole
ln -s "$source" whole/kpsa
sed 's/^find_package(kpsa.*/add_subdirectory(kpsa)/' program/CMakeLists.txt > whole/CMakeLists.txt
cp program/*.cpp whole
cmake -S whole -B whole-build -G Ninja -DCMAKE_BUILD_TYPE=Release > /dev/null
cmake --build whole-build --target CMakeFiles/embed.dir/embed.cpp.o > log.txt || { cat log.txt; exit 1; }
if ninja -C whole-build -t targets all | grep -q "test_\|bench_"; then
  echo "the tests of kpsa are part of another project's build"
  exit 1
fi
