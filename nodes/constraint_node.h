// What all constraints of a transform share. A constraint owns the local matrix: its outMatrix drives the
// constrained transform's offsetParentMatrix, and what did so before (a clip or the rest value) comes in as
// inMatrix.
//
// With maintainOffset the rest pose stays as it is, bit for bit: while the targets, the parent and inMatrix
// are as at rest, outMatrix is inMatrix.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "base/matrix.h"
#include "graph/node_registry.h"

namespace kpsa::engine {

// The shared inputs; and what a constraint's compute sees, with its own.
using ConstraintInputs =
    NodeContext<In<"targetMatrix", ArrayView<Matrix4>>, In<"targetWeight", ArrayView<double>>,
                In<"inMatrix", Matrix4>, In<"parentMatrix", Matrix4>, In<"blend", double>>;
template <typename... Own>
using ConstraintContext =
    NodeContext<In<"targetMatrix", ArrayView<Matrix4>>, In<"targetWeight", ArrayView<double>>,
                In<"inMatrix", Matrix4>, In<"parentMatrix", Matrix4>, In<"blend", double>, Own...,
                Out<"outMatrix", Matrix4>>;

// Declares targetMatrix, targetWeight, inMatrix, parentMatrix, blend and maintainOffset. Declare the
// constraint's own inputs next, then outMatrix.
NodeBuilder AddConstraint(NodeRegistry& registry, std::string name, std::string doc);

// The rest values of the shared inputs, as bound.
class ConstraintRest {
 public:
  static Result<ConstraintRest> Bind(const Structural& structural);
  bool maintain() const { return maintain_; }
  const Matrix4& in() const { return in_; }
  const Matrix4& parent() const { return parent_; }
  const Matrix4& parent_inverse() const { return parent_inverse_; }
  std::span<const Matrix4> targets() const { return targets_; }
  // Whether inMatrix must come out as it is. Own inputs of the constraint are its own to compare.
  bool Holds(ConstraintInputs c) const;

 private:
  bool maintain_ = false;
  Matrix4 in_, parent_, parent_inverse_;
  std::vector<Matrix4> targets_;
};

// The weight of a target: 1 where unset.
inline double TargetWeight(ConstraintInputs c, std::uint32_t i) {
  const ArrayView<double> weights = c.get<"targetWeight">();
  return i < weights.size() ? weights[i] : 1.0;
}
// Of all targets; at 0 a constraint does nothing.
double TotalWeight(ConstraintInputs c);
inline Double3 PlaceOf(const Matrix4& m) { return {m(0, 3), m(1, 3), m(2, 3)}; }

}  // namespace kpsa::engine
