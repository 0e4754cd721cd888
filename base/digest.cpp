#include "base/digest.h"

#include <fmt/format.h>

#include <bit>

static_assert(std::endian::native == std::endian::little, "words are read as they lie in memory");

namespace kpsa::engine {
namespace {

// A bijective mix of 64 bits (xor-shift and odd multiplications).
std::uint64_t Mix(std::uint64_t v) {
  v ^= v >> 32;
  v *= 0xd6e8feb86659fd93ull;
  v ^= v >> 32;
  v *= 0xd6e8feb86659fd93ull;
  return v ^ (v >> 32);
}

std::uint64_t Rotate(std::uint64_t v, int bits) { return (v << bits) | (v >> (64 - bits)); }

}  // namespace

std::string Digest::ToHex() const { return fmt::format("{:016x}{:016x}", hi, lo); }

void Hasher::AddBytes(const void* data, std::size_t size) {
  const auto* bytes = static_cast<const unsigned char*>(data);
  length_ += size;
  while (size > 0) {
    const std::size_t step = size < 8 ? size : 8;
    std::uint64_t word = 0;
    if (step == 8) {
      std::memcpy(&word, bytes, 8);
    } else {
      std::memcpy(&word, bytes, step);
    }
    a_ = Rotate(a_ ^ Mix(word + 0x9e3779b97f4a7c15ull), 27) * 5 + b_;
    b_ = Rotate(b_ + Mix(word ^ a_), 31) * 9 + step;
    bytes += step;
    size -= step;
  }
}

void Hasher::AddLongBytes(const void* data, std::size_t size) {
  constexpr std::size_t kLanes = 4, kStep = 8 * kLanes;
  const auto* bytes = static_cast<const unsigned char*>(data);
  std::uint64_t lanes[kLanes] = {0, 1, 2, 3};
  const unsigned char* const end = bytes + size / kStep * kStep;
  for (; bytes != end; bytes += kStep) {
    std::uint64_t words[kLanes];
    std::memcpy(words, bytes, kStep);
    for (std::size_t i = 0; i < kLanes; ++i)
      lanes[i] = Rotate(lanes[i] + words[i] * 0xc2b2ae3d27d4eb4full, 31) * 0x9e3779b97f4a7c15ull;
  }
  AddBytes(lanes, sizeof(lanes));
  AddBytes(bytes, size % kStep);
}

void Hasher::Add(std::string_view text) {
  Add(static_cast<std::uint64_t>(text.size()));
  AddBytes(text.data(), text.size());
}

Digest Hasher::Finish() const {
  const std::uint64_t a = Mix(a_ ^ length_), b = Mix(b_ + a);
  return {a ^ Rotate(b, 17), b};
}

}  // namespace kpsa::engine
