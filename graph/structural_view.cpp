#include "graph/structural_view.h"

#include "base/near_names.h"
#include "graph/authored.h"

namespace kpsa::engine {

int StructuralView::Attribute(std::string_view name) const {
  const NodeDef& def = table_.graph().def(node_);
  const int attribute = def.FindAttribute(name);
  if (attribute < 0) {
    const std::vector<std::string> names = def.AttributeNames();
    ThrowMisuse("it asks for \"{}\", which is no attribute of it{}; it has {}", name,
                DidYouMean(std::string(name), names), fmt::join(names, ", "));
  }
  return attribute;
}

const std::type_info* StructuralView::choice_type(std::string_view name) const {
  return table_.graph().def(node_).attributes[static_cast<std::size_t>(Attribute(name))].choice;
}

int StructuralView::Element(int attribute, int element) const {
  const AttributeDef& a = table_.graph().def(node_).attributes[static_cast<std::size_t>(attribute)];
  return a.array && element < 0 ? geometry() : element;
}

const Value& StructuralView::value(std::string_view name, int element) const {
  const int attribute = Attribute(name);
  element = Element(attribute, element);
  if (instance_ != nullptr && statics_ != nullptr) {
    for (const StructuralInput& input : instance_->structural) {
      if (input.attribute != attribute || input.element != element) continue;
      if (const Value* driven = statics_->Get(input.source, false)) return *driven;
      // The failure is told instead of what follows from the value that stands in for it
      statics_->TellOfFailure(table_.graph().PlugName({node_, attribute, element, -1}));
      break;
    }
  }
  return *table_.HeldValue(node_, attribute, element);
}

bool StructuralView::is_set(std::string_view name, int element) const {
  const int attribute = Attribute(name);
  return table_.IsSet(node_, attribute, Element(attribute, element));
}

int StructuralView::array_size(std::string_view name) const {
  return table_.ArraySize(node_, Attribute(name));
}

const Value* StructuralView::rest(std::string_view name, int element) const {
  if (instance_ == nullptr || statics_ == nullptr) return nullptr;
  const int attribute = Attribute(name);
  element = Element(attribute, element);
  const ComputeGroup& group = table_.group(*instance_);
  for (const Input& input : instance_->inputs) {
    if (group.inputs[static_cast<std::size_t>(input.position)] == attribute && input.element == element) {
      return statics_->Get(input.rest, true);
    }
  }
  return table_.HeldValue(node_, attribute, element, true);
}

}  // namespace kpsa::engine
