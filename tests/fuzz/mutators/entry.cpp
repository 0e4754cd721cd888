// Where libFuzzer asks for a changed input; KPSA_MUTATE is who changes it (bytes.h).
#include <algorithm>

#include "tests/fuzz/mutators/bytes.h"

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t most);

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t most,
                                               unsigned seed) {
  const auto change = [](kpsa::engine::FuzzBytes* bytes, std::size_t room) {
    const std::size_t before = bytes->size();
    bytes->resize(std::max(before, room));
    bytes->resize(LLVMFuzzerMutate(bytes->data(), std::min(before, room), room));
  };
  return kpsa::engine::MutateFor(&kpsa::engine::KPSA_MUTATE, change, data, size, most, seed);
}
