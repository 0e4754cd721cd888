// twistDistribution: twist joints take their shares of how far one transform is twisted against another.
#include <utility>

#include "base/scalar_math.h"
#include "nodes/deformer.h"
#include "nodes/kernels/constraint_math.h"
#include "nodes/kernels/matrix_parts.h"
#include "nodes/kernels/transform_math.h"
#include "nodes/node_file.h"

namespace kpsa::engine {
namespace {

using TwistContext =
    NodeContext<In<"startMatrix", Matrix4>, In<"endMatrix", Matrix4>, In<"inMatrix", ArrayView<Matrix4>>,
                In<"weight", ArrayView<double>>, In<"blend", double>, Out<"outMatrix", OutArray<Matrix4>>>;

struct TwistKernel {
  Quaternion rest;                // of the end against the start
  Double3 axis;                   // of the bone, in the start's axes
  std::vector<Double3> own_axes;  // the same in each joint's
  std::vector<int> above;         // which joint each hangs under; -1: the start
};

Result<BoundKernel> BindTwist(const Binding& binding) {
  const Structural& s = binding.structural();
  Result<Matrix4> start = RestMatrix(s, "startMatrix"), end = RestMatrix(s, "endMatrix");
  if (!start.ok()) return start.status();
  if (!end.ok()) return end.status();
  TwistKernel k;
  const MatrixParts from = TakeApart(*start), to = TakeApart(*end);
  k.rest = Normalized(Conjugate(from.rotation) * to.rotation);
  Double3 axis = Rotate(Conjugate(from.rotation), to.translation - from.translation);
  if (s.is_set("axis")) axis = s.value("axis").get<Double3>();
  if (!Direction(axis, 0, &k.axis))
    return Status::Invalid("startMatrix and endMatrix are at one place at rest: set the axis");
  const auto& parents = s.value("parents").get<std::vector<std::int64_t>>();
  const int joints = s.array_size("inMatrix");
  std::vector<Quaternion> turns;  // of the joints at rest, in the start's axes
  for (int i = 0; i < joints; ++i) {
    const Value* in = s.rest("inMatrix", i);
    if (in == nullptr || in->get_if<Matrix4>() == nullptr)
      return Status::Invalid("inMatrix[{}] has no value at rest", i);
    const auto at = static_cast<std::size_t>(i);
    const std::int64_t above = at < parents.size() ? parents[at] : i - 1;
    if (above < -1 || above >= i)
      return Status::Invalid("parents: entry {} is {}, expected -1 to {}", i, above, i - 1);
    const Quaternion own = TakeApart(in->get<Matrix4>()).rotation;
    turns.push_back(above < 0 ? own : turns[static_cast<std::size_t>(above)] * own);
    k.above.push_back(static_cast<int>(above));
    k.own_axes.push_back(Rotate(Conjugate(turns.back()), k.axis));
  }
  return MakeBound(std::move(k), 0);
}

void ComputeTwist(TwistContext c) {
  const auto& k = c.kernel_as<TwistKernel>();
  const Quaternion now =
      Conjugate(TakeApart(c.get<"startMatrix">()).rotation) * TakeApart(c.get<"endMatrix">()).rotation;
  // Against rest in the start's axes: now = twisted . rest
  const Quaternion against = Normalized(now * Conjugate(k.rest));
  const double twist = TwistAngle(DecomposeSwingTwist(against, k.axis).twist, k.axis) * c.get<"blend">();
  const ArrayView<Matrix4> joints = c.get<"inMatrix">();
  const ArrayView<double> weights = c.get<"weight">();
  const auto share = [&](std::uint32_t i) {
    return i < weights.size() ? weights[i] : (i + 1.0) / (joints.size() + 1.0);
  };
  const OutArray<Matrix4> out_matrices = c.out<"outMatrix">();
  for (std::uint32_t i = 0; i < out_matrices.size(); ++i) {
    Matrix4& out = out_matrices[i];
    out = i < joints.size() ? joints[i] : Matrix4();
    if (i >= joints.size()) continue;
    const int above = k.above[i];
    const double own = share(i) - (above < 0 ? 0 : share(static_cast<std::uint32_t>(above)));
    // Less than rounding makes of a pose at rest is no twist
    if (!(twist * own > 1e-12 || twist * own < -1e-12)) continue;
    out = out * RotationFromUnit(AxisAngle(k.own_axes[i], twist * own));
  }
}

}  // namespace

KPSA_NODES(twist_distribution, registry) {
  registry
      .add("twistDistribution",
           "Twists joints by shares of how far `end` is twisted against `start` about the bone. The end must "
           "not hang under the joints: name what the end follows (a control), or joints beside it.")
      .category("constraint")
      .in("startMatrix", Matrix4(),
          {.doc = "worldMatrix of what the joints hang under; `start:` connects it"})
      .in("endMatrix", Matrix4(), {.doc = "worldMatrix of what twists; `end:` connects it"})
      .in("inMatrix", Matrix4(), {.doc = "local matrices of the joints below"})
      .array()
      .in("weight", 0.0,
          {.min = -1,
           .max = 1,
           .doc = "share of the joint, with what it gets from above; none set: even steps"})
      .array()
      .in("blend", 1.0, {.min = 0, .max = 1, .doc = "0: the matrices below"})
      .structural("axis", Double3(),
                  {.doc = "of the bone, in start's axes; unset: from start to end at rest"})
      .structural("parents", std::vector<std::int64_t>{},
                  {.doc = "which joint each joint hangs under, -1 for start; default: the one before it"})
      .out("outMatrix", Type::kMatrix, "local, for the joints' offsetParentMatrix")
      .array()
      .compute<ComputeTwist>()
      .bind(BindTwist)
      .cost(500, 0);
}

}  // namespace kpsa::engine
