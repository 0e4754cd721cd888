// Point data: structure-of-arrays float32, 64-byte aligned, every component padded to a multiple of 16
// floats. The padding may be read and written by kernels; its content means nothing.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "base/types.h"

namespace kpsa::engine {

inline constexpr std::size_t kPointAlignment = 64;  // bytes
inline constexpr std::size_t kPointPadding = 16;    // floats

// Floats that one component of `count` points occupies.
inline std::size_t PaddedCount(std::size_t count) {
  return (count + kPointPadding - 1) / kPointPadding * kPointPadding;
}

// A view of N values of 3 floats (points, colors) or 1 float (weights: y and z are null).
// Each component starts at a 64-byte boundary and holds PaddedCount(count) floats.
struct ConstPointsView {
  const float* x = nullptr;
  const float* y = nullptr;
  const float* z = nullptr;
  std::size_t count = 0;
};
struct PointsView {
  float* x = nullptr;
  float* y = nullptr;
  float* z = nullptr;
  std::size_t count = 0;
  operator ConstPointsView() const { return {x, y, z, count}; }  // NOLINT: implicit by design
};

// Owns aligned floats.
class AlignedFloats {
 public:
  AlignedFloats() = default;
  explicit AlignedFloats(std::size_t size);  // zeros
  // To be written before they are read.
  static AlignedFloats Uninitialized(std::size_t size);
  // Likewise, bit by bit: memory is taken as it is written (PreferLargePages).
  static AlignedFloats Untouched(std::size_t size);
  AlignedFloats(AlignedFloats&&) noexcept;
  AlignedFloats& operator=(AlignedFloats&&) noexcept;
  AlignedFloats(const AlignedFloats& other);
  AlignedFloats& operator=(const AlignedFloats& other);
  ~AlignedFloats();
  float* data() { return data_; }
  const float* data() const { return data_; }
  std::size_t size() const { return size_; }
  std::span<float> span() { return {data_, size_}; }
  std::span<const float> span() const { return {data_, size_}; }

 private:
  float* data_ = nullptr;
  std::size_t size_ = 0;
};

// Owns the buffer of N points (3 components) or weights (1 component).
class PointBuffer {
 public:
  PointBuffer() = default;
  explicit PointBuffer(std::size_t count, int components = 3);
  static PointBuffer FromInterleaved(std::span<const float> xyz);  // x0 y0 z0 x1 ...
  static PointBuffer FromPlaces(std::span<const Double3> places);  // rounded
  std::size_t count() const { return count_; }
  int components() const { return components_; }
  PointsView view();
  ConstPointsView view() const;
  std::vector<float> Interleaved() const;

 private:
  AlignedFloats floats_;
  std::size_t count_ = 0;
  int components_ = 3;
};

// Copies all components, where they differ in address.
void CopyPoints(ConstPointsView in, PointsView out);

// Compressed rows: row i is values[offsets[i] .. offsets[i + 1]). offsets has rows() + 1 entries.
template <typename T>
struct CsrView {
  std::span<const Index> offsets;
  std::span<const T> values;
  std::size_t rows() const { return offsets.empty() ? 0 : offsets.size() - 1; }
  std::span<const T> row(std::size_t i) const {
    return values.subspan(offsets[i], offsets[i + 1] - offsets[i]);
  }
};

}  // namespace kpsa::engine
