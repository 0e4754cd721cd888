#include "tests/fuzz/mutators/bytes.h"

#include <cstring>

namespace kpsa::engine {

std::uint32_t U32At(const FuzzBytes& bytes, std::size_t at) {
  std::uint32_t value = 0;
  std::memcpy(&value, bytes.data() + at, 4);
  return value;
}

void PutU32(std::uint32_t value, FuzzBytes* bytes) {
  for (int i = 0; i < 4; ++i) bytes->push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

std::size_t MutateFor(FuzzBytes (*mutate)(const FuzzBytes&, std::size_t, std::uint32_t, const ChangeBytes&),
                      const ChangeBytes& change, std::uint8_t* data, std::size_t size, std::size_t most,
                      std::uint32_t random) {
  const FuzzBytes mutated = mutate(FuzzBytes(data, data + size), most, random, change);
  if (mutated.size() > most) return size;
  if (!mutated.empty()) std::memcpy(data, mutated.data(), mutated.size());
  return mutated.size();
}

}  // namespace kpsa::engine
