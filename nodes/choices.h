// Choices that several node types offer.
#pragma once

#include <cstdint>
#include <initializer_list>

#include "base/types.h"
#include "graph/node_builder.h"

namespace kpsa::engine {

inline constexpr std::initializer_list<Choice<RotateOrder>> kRotateOrders = {
    {"xyz", RotateOrder::kXyz}, {"yzx", RotateOrder::kYzx}, {"zxy", RotateOrder::kZxy},
    {"xzy", RotateOrder::kXzy}, {"yxz", RotateOrder::kYxz}, {"zyx", RotateOrder::kZyx}};

enum class Axis : std::uint8_t { kX, kY, kZ };
inline constexpr std::initializer_list<Choice<Axis>> kAxes = {
    {"x", Axis::kX}, {"y", Axis::kY}, {"z", Axis::kZ}};

constexpr Double3 UnitVector(Axis axis) {
  switch (axis) {
    case Axis::kX:
      return {1, 0, 0};
    case Axis::kY:
      return {0, 1, 0};
    case Axis::kZ:
      break;
  }
  return {0, 0, 1};
}

}  // namespace kpsa::engine
