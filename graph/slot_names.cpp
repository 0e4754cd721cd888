#include "graph/slot_names.h"

#include "graph/value.h"

namespace kpsa::engine {

bool IsPlainSlot(SlotKind kind, Type type) {
  switch (kind) {
    case SlotKind::kDouble:
      return type == Type::kDouble;
    case SlotKind::kDouble3:
      return type == Type::kDouble3;
    case SlotKind::kQuaternion:
      return type == Type::kQuaternion;
    case SlotKind::kMatrix:
      return type == Type::kMatrix;
    case SlotKind::kPoints:
      return IsPointType(type);
    default:
      return false;
  }
}

const char* PlainSlotName(SlotKind kind) {
  switch (kind) {
    case SlotKind::kDouble:
      return "double";
    case SlotKind::kDouble3:
      return "Double3";
    case SlotKind::kQuaternion:
      return "Quaternion";
    case SlotKind::kMatrix:
      return "Matrix4";
    case SlotKind::kPoints:
      return "ConstPointsView";
    default:
      return nullptr;
  }
}

}  // namespace kpsa::engine
