#!/bin/sh
# Builds the fuzzers with clang and sanitizers and runs each for that many seconds, one after the other:
#   sh tests/fuzz/run.sh SECONDS [NAME...]
# New inputs are kept in build-fuzz/corpus/NAME and used the next time, findings in build-fuzz/findings/NAME. Prints a
# table; the exit status says whether there are findings (docs/safety.md).
set -e
cd "$(dirname "$0")/../.."
all="rig gltf subspace npz caches weights expression frames graph"
refuse() {
  echo "tests/fuzz/run.sh: $1; usage: sh tests/fuzz/run.sh SECONDS [NAME...], of $all" >&2
  exit 2
}
seconds=${1:-nothing}
case $seconds in
  0* | *[!0-9]*) refuse "expected seconds for each fuzzer, found \"$seconds\"" ;;
esac
shift
for name in "$@"; do
  case " $all " in
    *" $name "*) ;;
    *) refuse "there is no fuzzer \"$name\"" ;;
  esac
done
folder=$PWD/build-fuzz
sh cmake/dependencies.sh clang libclang-rt-14-dev
cmake -S . -B "$folder/build" -G Ninja -DCMAKE_CXX_COMPILER=clang++ -DCMAKE_BUILD_TYPE=None -DCMAKE_CXX_FLAGS="-O1 -g1" -DKPSA_FUZZ=ON > /dev/null
targets=
for name in ${*:-$all}; do targets="$targets fuzz_$name"; done
cmake --build "$folder/build" --target $targets

# An input may take so much memory and time, and be so long
temporary=$(mktemp -d -p /dev/shm 2> /dev/null || mktemp -d)
trap 'rm -rf "$temporary"' EXIT
export TMPDIR="$temporary"
export ASAN_OPTIONS=allocator_may_return_null=1:detect_stack_use_after_return=0:quarantine_size_mb=64
table=$folder/table.txt
printf '%-12s %12s %9s %9s %8s %9s\n' fuzzer executions 'a second' features inputs findings > "$table"
findings=0
for name in ${*:-$all}; do
  case $name in
    gltf | subspace) longest=65536 ;;
    expression | frames) longest=512 ;;
    *) longest=8192 ;;
  esac
  kept=$folder/corpus/$name found=$folder/findings/$name log=$folder/$name.log
  mkdir -p "$kept" "$found"
  dictionary=
  [ -f "tests/fuzz/dictionaries/$name.dict" ] && dictionary=-dict=tests/fuzz/dictionaries/$name.dict
  before=$(find "$found" -type f | wc -l)
  # One process after the other: what is found does not end the search
  end=$(($(date +%s) + seconds))
  : > "$log"
  while left=$((end - $(date +%s))) && [ "$left" -gt 0 ]; do
    "$folder/build/tests/fuzz/fuzz_$name" -max_total_time="$left" -rss_limit_mb=2048 -malloc_limit_mb=1024 -timeout=20 \
      -max_len=$longest -print_final_stats=1 $dictionary -artifact_prefix="$found/" "$kept" "tests/fuzz/corpus/$name" >> "$log" 2>&1 && break
    [ "$(find "$found" -type f | wc -l)" -ge $((before + 20)) ] && break
  done
  executions=$(awk '/stat::number_of_executed_units/ {sum += $2} END {print sum + 0}' "$log")
  features=$(awk '{for (i = 1; i < NF; ++i) if ($i == "ft:" && $(i + 1) + 0 > most) most = $(i + 1) + 0} END {print most + 0}' "$log")
  new=$(($(find "$found" -type f | wc -l) - before))
  findings=$((findings + new))
  printf '%-12s %12d %9d %9d %8d %9d\n' "$name" "$executions" $((executions / seconds)) "$features" "$(find "$kept" -type f | wc -l)" "$new" >> "$table"
  tail -1 "$table"
done
echo
cat "$table"
[ "$findings" = 0 ]
