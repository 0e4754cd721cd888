// Mutators that know a format: they change a part of an input, and write the lengths around it anew, so that a reader
// comes past its first checks. A changer of bytes is libFuzzer's in a fuzzer, and a simple one in tests.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

namespace kpsa::engine {

using FuzzBytes = std::vector<std::uint8_t>;
// Changes bytes, of which there are at most `most` afterwards.
using ChangeBytes = std::function<void(FuzzBytes* bytes, std::size_t most)>;

// A .glb: one of its chunks. Anything else: all of it, or, seldom, what makes it a .glb.
FuzzBytes MutateGlb(const FuzzBytes& glb, std::size_t most, std::uint32_t random, const ChangeBytes& change);
// A file of tensors (files/safetensors.h): the bytes of one tensor, a number in it, or the header. Anything else: all
// of it.
FuzzBytes MutateTensors(const FuzzBytes& file, std::size_t most, std::uint32_t random,
                        const ChangeBytes& change);

std::uint32_t U32At(const FuzzBytes& bytes, std::size_t at);
void PutU32(std::uint32_t value, FuzzBytes* bytes);

// Hands an input of libFuzzer's to one of these.
std::size_t MutateFor(FuzzBytes (*mutate)(const FuzzBytes&, std::size_t, std::uint32_t, const ChangeBytes&),
                      const ChangeBytes& change, std::uint8_t* data, std::size_t size, std::size_t most,
                      std::uint32_t random);

}  // namespace kpsa::engine
