// Where libFuzzer comes in: a program has one fuzzer.
#include "tests/fuzz/fuzzer.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  kpsa::engine::Fuzzers().front().run({data, size});
  return 0;
}
