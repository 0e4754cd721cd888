// KHR_animation_pointer: JSON pointers to what a channel animates. Nothing outside gltf/ includes this.
#pragma once

#include <cstdint>
#include <string>

#include "base/status.h"

namespace kpsa::engine::gltf {

struct PointedAt {
  std::uint64_t node = 0;
  std::string path;  // translation, rotation, scale or weights
};

// Whether the pointer is one of those that are read, which *at is set to. Errors: no JSON pointer; one that
// names no node of `node_count`.
Result<bool> ResolvePointer(const std::string& pointer, std::size_t node_count, PointedAt* at);

}  // namespace kpsa::engine::gltf
