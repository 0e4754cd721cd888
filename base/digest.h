// Content hashes: 128 bits, the same on every machine. Not cryptographic.
#pragma once

#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

namespace kpsa::engine {

struct Digest {
  std::uint64_t lo = 0, hi = 0;
  friend bool operator==(const Digest&, const Digest&) = default;
  friend auto operator<=>(const Digest&, const Digest&) = default;
  std::string ToHex() const;  // 32 digits
};

// Feeds bytes in and gives their digest. Every call begins a word of 8 bytes, so the same bytes in other calls
// give another digest; strings and spans are fed with their length, so that ("ab","c") and ("a","bc") differ.
class Hasher {
 public:
  void AddBytes(const void* data, std::size_t size);
  void Add(std::string_view text);
  void Add(const char* text) { Add(std::string_view(text)); }
  template <typename T>
  requires std::is_arithmetic_v<T> || std::is_enum_v<T>
  void Add(T value) { AddBytes(&value, sizeof(value)); }
  template <typename T>
  requires std::is_trivially_copyable_v<T>
  void Add(std::span<const T> values) {
    Add(static_cast<std::uint64_t>(values.size()));
    AddBytes(values.data(), values.size_bytes());
  }
  // The same of many bytes in a fraction of the time (four words at once); another digest than Add gives.
  template <typename T>
  requires std::is_trivially_copyable_v<T>
  void AddLong(std::span<const T> values) {
    Add(static_cast<std::uint64_t>(values.size()));
    AddLongBytes(values.data(), values.size_bytes());
  }
  void AddLongBytes(const void* data, std::size_t size);
  void Add(const Digest& digest) {
    Add(digest.lo);
    Add(digest.hi);
  }
  Digest Finish() const;

 private:
  std::uint64_t a_ = 0x9e3779b97f4a7c15ull, b_ = 0xc2b2ae3d27d4eb4full;
  std::uint64_t length_ = 0;
};

}  // namespace kpsa::engine
