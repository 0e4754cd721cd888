// Storage of numbers for SIMD kernels.
#pragma once

#include <cstddef>
#include <cstring>
#include <span>

#include "base/points.h"

namespace kpsa::engine {

// 64-byte aligned storage of halfs or floats.
template <typename T>
class AlignedArray {
 public:
  AlignedArray() = default;
  explicit AlignedArray(std::size_t size) : floats_((size * sizeof(T) + 3) / 4), size_(size) {}
  // Of these bytes; the rest of the last float is unknown.
  explicit AlignedArray(std::span<const std::byte> bytes)
      : floats_(AlignedFloats::Uninitialized((bytes.size() + 3) / 4)), size_(bytes.size() / sizeof(T)) {
    if (!bytes.empty()) std::memcpy(floats_.data(), bytes.data(), bytes.size());
  }
  T* data() { return reinterpret_cast<T*>(floats_.data()); }
  const T* data() const { return reinterpret_cast<const T*>(floats_.data()); }
  std::size_t size() const { return size_; }
  std::span<const T> span() const { return {data(), size_}; }
  std::span<T> span() { return {data(), size_}; }

 private:
  AlignedFloats floats_;
  std::size_t size_ = 0;
};

}  // namespace kpsa::engine
