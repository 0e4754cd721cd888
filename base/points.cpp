#include "base/points.h"

#include <cstring>
#include <new>
#include <utility>

#include "base/check.h"
#include "base/fresh_pages.h"

namespace kpsa::engine {

AlignedFloats AlignedFloats::Untouched(std::size_t size) {
  AlignedFloats floats;
  if (size == 0) return floats;
  const std::size_t bytes = size * sizeof(float);
  floats.data_ = static_cast<float*>(::operator new(bytes, std::align_val_t(AlignmentFor(bytes))));
  floats.size_ = size;
  PreferLargePages(floats.data_, bytes);
  return floats;
}

AlignedFloats AlignedFloats::Uninitialized(std::size_t size) {
  AlignedFloats floats = Untouched(size);
  if (size > 0) TouchPages(floats.data_, size * sizeof(float));
  return floats;
}

AlignedFloats::AlignedFloats(std::size_t size) : AlignedFloats(Uninitialized(size)) {
  if (size > 0) std::memset(data_, 0, size * sizeof(float));
}

AlignedFloats::AlignedFloats(AlignedFloats&& other) noexcept
    : data_(std::exchange(other.data_, nullptr)), size_(std::exchange(other.size_, 0)) {}

AlignedFloats& AlignedFloats::operator=(AlignedFloats&& other) noexcept {
  std::swap(data_, other.data_);
  std::swap(size_, other.size_);
  return *this;
}

AlignedFloats::AlignedFloats(const AlignedFloats& other) : AlignedFloats(Uninitialized(other.size_)) {
  if (size_ > 0) std::memcpy(data_, other.data_, size_ * sizeof(float));
}

AlignedFloats& AlignedFloats::operator=(const AlignedFloats& other) {
  if (this != &other) *this = AlignedFloats(other);
  return *this;
}

AlignedFloats::~AlignedFloats() {
  if (data_ != nullptr) ::operator delete(data_, std::align_val_t(AlignmentFor(size_ * sizeof(float))));
}

PointBuffer::PointBuffer(std::size_t count, int components)
    : floats_(PaddedCount(count) * static_cast<std::size_t>(components)),
      count_(count),
      components_(components) {
  KPSA_CHECK(components == 1 || components == 3);
}

PointBuffer PointBuffer::FromInterleaved(std::span<const float> xyz) {
  PointBuffer buffer(xyz.size() / 3);
  const PointsView view = buffer.view();
  for (std::size_t i = 0; i < view.count; ++i) {
    view.x[i] = xyz[3 * i];
    view.y[i] = xyz[3 * i + 1];
    view.z[i] = xyz[3 * i + 2];
  }
  return buffer;
}

PointBuffer PointBuffer::FromPlaces(std::span<const Double3> places) {
  PointBuffer buffer(places.size());
  const PointsView view = buffer.view();
  for (std::size_t i = 0; i < view.count; ++i) {
    view.x[i] = static_cast<float>(places[i].x);
    view.y[i] = static_cast<float>(places[i].y);
    view.z[i] = static_cast<float>(places[i].z);
  }
  return buffer;
}

PointsView PointBuffer::view() {
  float* x = floats_.data();
  const std::size_t padded = PaddedCount(count_);
  if (components_ == 1) return {x, nullptr, nullptr, count_};
  return {x, x + padded, x + 2 * padded, count_};
}

ConstPointsView PointBuffer::view() const { return const_cast<PointBuffer*>(this)->view(); }

std::vector<float> PointBuffer::Interleaved() const {
  const ConstPointsView points = view();
  std::vector<float> xyz(count_ * static_cast<std::size_t>(components_));
  for (std::size_t i = 0; i < count_; ++i) {
    if (components_ == 1) {
      xyz[i] = points.x[i];
    } else {
      xyz[3 * i] = points.x[i];
      xyz[3 * i + 1] = points.y[i];
      xyz[3 * i + 2] = points.z[i];
    }
  }
  return xyz;
}

void CopyPoints(ConstPointsView in, PointsView out) {
  const std::size_t bytes = out.count * sizeof(float);
  if (bytes == 0) return;
  if (in.x != out.x) std::memcpy(out.x, in.x, bytes);
  if (out.y != nullptr && in.y != out.y) std::memcpy(out.y, in.y, bytes);
  if (out.z != nullptr && in.z != out.z) std::memcpy(out.z, in.z, bytes);
}

}  // namespace kpsa::engine
