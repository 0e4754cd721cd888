// What stands in a slot, as C++ sees it, and how a compute that reads and writes by position is held against that
// (graph/compute_context.h).
#pragma once

#include <cstdint>
#include <type_traits>

#include "base/points.h"
#include "base/types.h"

namespace kpsa::engine {

enum class SlotKind : std::uint8_t {
  kBool,     // of Type::kBool
  kInteger,  // of Type::kInt and kEnum
  kChoice,   // a scoped enum: of Type::kEnum
  kDouble,
  kDouble3,
  kQuaternion,
  kMatrix,
  kPoints,  // ConstPointsView and PointsView: of points, colors and weights
  kOther,   // of none
};

// The kind of slots that a C++ type reads and writes.
template <typename T>
constexpr SlotKind SlotKindOf() {
  if constexpr (std::is_same_v<T, bool>)
    return SlotKind::kBool;
  else if constexpr (std::is_integral_v<T>)
    return SlotKind::kInteger;
  else if constexpr (std::is_enum_v<T>)
    return SlotKind::kChoice;
  else if constexpr (std::is_same_v<T, double>)
    return SlotKind::kDouble;
  else if constexpr (std::is_same_v<T, Double3>)
    return SlotKind::kDouble3;
  else if constexpr (std::is_same_v<T, Quaternion>)
    return SlotKind::kQuaternion;
  else if constexpr (std::is_same_v<T, Matrix4>)
    return SlotKind::kMatrix;
  else if constexpr (std::is_same_v<T, ConstPointsView> || std::is_same_v<T, PointsView>)
    return SlotKind::kPoints;
  else
    return SlotKind::kOther;
}

// What a compute asks its context for by position: the bytes of a slot as a T, or an array of them.
struct SlotAccess {
  SlotKind kind = SlotKind::kOther;  // kInteger: of std::int64_t, which bools and enums are in a slot, too
  int position = 0;
  bool input = true, array = false;

  template <typename T>
  static constexpr SlotAccess Of(int position, bool input, bool array) {
    constexpr bool kSlot = !std::is_same_v<T, bool> && !std::is_enum_v<T> &&
                           (!std::is_integral_v<T> || (sizeof(T) == 8 && std::is_signed_v<T>));
    return {kSlot ? SlotKindOf<T>() : SlotKind::kOther, position, input, array};
  }
};

}  // namespace kpsa::engine
