#include "nodes/constraint_node.h"

#include "nodes/deformer.h"

namespace kpsa::engine {

NodeBuilder AddConstraint(NodeRegistry& registry, std::string name, std::string doc) {
  NodeBuilder b = registry.add(std::move(name), std::move(doc));
  b.category("constraint")
      .in("targetMatrix", Matrix4(), {.doc = "world matrices; `targets:` connects them"})
      .array()
      .in("targetWeight", 1.0, {.min = 0, .doc = "of the target; 1 where unset. All 0: no constraint"})
      .array()
      .in("inMatrix", Matrix4(), {.doc = "the local matrix below: what the clip or the rest pose says"})
      .in("parentMatrix", Matrix4(), {.doc = "worldMatrix of the constrained transform's parent"})
      .world_place()
      .in("blend", 1.0, {.min = 0, .max = 1, .doc = "0: inMatrix, 1: the constraint"})
      .structural("maintainOffset", false, {.doc = "keeps how the constrained lies to its targets at rest"});
  return b;
}

Result<ConstraintRest> ConstraintRest::Bind(const Structural& s) {
  ConstraintRest rest;
  rest.maintain_ = s.get_bool("maintainOffset");
  Result<Matrix4> in = RestMatrix(s, "inMatrix"), parent = RestMatrix(s, "parentMatrix");
  if (!in.ok()) return in.status();
  if (!parent.ok()) return parent.status();
  rest.in_ = *in, rest.parent_ = *parent;
  if (!Invert(*parent, &rest.parent_inverse_) && rest.maintain_)
    return Status::Invalid("parentMatrix is singular at rest, so that no offset can be maintained");
  const int count = s.array_size("targetMatrix");
  for (int i = 0; i < count; ++i) {
    const Value* target = s.rest("targetMatrix", i);
    if (target == nullptr || target->get_if<Matrix4>() == nullptr)
      return Status::Invalid("targetMatrix[{}] has no value at rest", i);
    rest.targets_.push_back(target->get<Matrix4>());
  }
  return rest;
}

bool ConstraintRest::Holds(ConstraintInputs c) const {
  if (!maintain_ || !(c.get<"inMatrix">() == in_) || !(c.get<"parentMatrix">() == parent_)) return false;
  const ArrayView<Matrix4> targets = c.get<"targetMatrix">();
  for (std::uint32_t i = 0; i < targets.size(); ++i) {
    if (!(targets[i] == targets_[i])) return false;
  }
  return true;
}

double TotalWeight(ConstraintInputs c) {
  double total = 0;
  for (std::uint32_t i = 0; i < c.get<"targetMatrix">().size(); ++i) total += TargetWeight(c, i);
  return total;
}

}  // namespace kpsa::engine
