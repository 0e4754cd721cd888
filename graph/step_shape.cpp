#include "graph/step_shape.h"

#include "base/text.h"
#include "base/thrown.h"
#include "graph/slot_names.h"

namespace kpsa::engine {
namespace {

bool Holds(Type type, SlotKind kind) {
  if (kind == SlotKind::kInteger) return type == Type::kBool || type == Type::kInt || type == Type::kEnum;
  return IsPlainSlot(kind, type);
}

const char* NameOf(SlotKind kind) {
  if (kind == SlotKind::kInteger) return "std::int64_t";
  if (kind == SlotKind::kPoints) return "points";  // to read or to write
  const char* name = PlainSlotName(kind);
  return name != nullptr ? name : "a type that no slot is of (bools and enums are std::int64_t)";
}

std::string Described(const StepShape::Slot& slot) {
  return fmt::format("\"{}\" ({}{})", slot.name, TypeName(slot.type), slot.array ? " array" : "");
}

std::string ListOf(const std::vector<StepShape::Slot>& slots) {
  std::string list;
  for (const StepShape::Slot& slot : slots) list += (list.empty() ? "" : ", ") + slot.name;
  return list.empty() ? "none" : list;
}

}  // namespace

StepShape StepShape::Of(const NodeDef& def, const ComputeGroup& group) {
  StepShape shape;
  const auto add = [&](const std::vector<int>& numbers, std::vector<Slot>* slots) {
    for (const int number : numbers) {
      const AttributeDef& a = def.attributes[static_cast<std::size_t>(number)];
      slots->push_back({a.name, a.type, a.array && !(a.per_geometry && group.per_geometry)});
    }
  };
  add(group.inputs, &shape.inputs);
  add(group.outputs, &shape.outputs);
  return shape;
}

void StepShape::Check(const SlotAccess& access) const {
  const std::vector<Slot>& slots = access.input ? inputs : outputs;
  const char* word = access.input ? "input" : "output";
  if (access.position < 0 || static_cast<std::size_t>(access.position) >= slots.size()) {
    throw std::logic_error(fmt::format("its compute asks for {} {} (counted from 0), it has {} ({})", word,
                                       access.position, slots.size(), ListOf(slots)));
  }
  const Slot& slot = slots[static_cast<std::size_t>(access.position)];
  if (slot.array != access.array || !Holds(slot.type, access.kind)) {
    throw std::logic_error(fmt::format("its compute {} {} {}, {}, as {}{}", access.input ? "reads" : "writes",
                                       word, access.position, Described(slot),
                                       access.array ? "an array of " : "", NameOf(access.kind)));
  }
}

NoElement::NoElement(const std::uint32_t* where, std::uint32_t asked)
    : std::out_of_range(
          fmt::format("its compute asks for element {} of an array that has {}", asked, *where)),
      table(where),
      element(asked) {}

void ThrowNoElement(const std::uint32_t* table, std::uint32_t element) { throw NoElement(table, element); }

std::string ThrownByStep(const StepShape* shape, const ComputeContext& context) {
  try {
    throw;
  } catch (const NoElement& error) {
    const auto name = [&](const std::vector<StepShape::Slot>& slots, const std::uint32_t* table) {
      for (std::size_t i = 0; i < slots.size(); ++i) {
        if (slots[i].array && table + table[i] == error.table) return &slots[i];
      }
      return static_cast<const StepShape::Slot*>(nullptr);
    };
    const StepShape::Slot* slot = shape == nullptr ? nullptr : name(shape->inputs, context.in);
    if (slot == nullptr && shape != nullptr) slot = name(shape->outputs, context.out);
    return slot == nullptr ? std::string(error.what())
                           : fmt::format("its compute asks for element {} of {}, which has {}", error.element,
                                         Described(*slot), *error.table);
  } catch (...) {
    return ThrownText();
  }
}

}  // namespace kpsa::engine
