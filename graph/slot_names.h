// Slots that hold the same whichever way a compute reads them, by name or by position: all but bools, integers and
// enums. Internal to graph/.
#pragma once

#include "graph/slot_kind.h"

namespace kpsa::engine {

// Whether the slots of an attribute of that type are of this kind; false for bools, integers and enums.
bool IsPlainSlot(SlotKind kind, Type type);
// "Double3"; of points what a compute reads them as; null for bools, integers, enums and kOther.
const char* PlainSlotName(SlotKind kind);

}  // namespace kpsa::engine
