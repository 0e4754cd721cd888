// spaceSwitch: a transform under one of several parents, or between two of them.
#include <algorithm>
#include <cmath>
#include <utility>

#include "base/matrix.h"
#include "nodes/deformer.h"
#include "nodes/kernels/matrix_parts.h"
#include "nodes/node_file.h"

namespace kpsa::engine {
namespace {

using SpaceContext =
    NodeContext<In<"targetMatrix", ArrayView<Matrix4>>, In<"space", double>, In<"inMatrix", Matrix4>,
                In<"parentMatrix", Matrix4>, In<"blend", double>, Out<"outMatrix", Matrix4>>;

struct SpaceKernel {
  bool maintain = false;
  Matrix4 parent;                // at rest
  std::vector<Matrix4> spaces;   // at rest
  std::vector<Matrix4> offsets;  // space^-1 . parent, at rest
};

Result<BoundKernel> BindSpaceSwitch(const Binding& binding) {
  const Structural& s = binding.structural();
  SpaceKernel kernel;
  kernel.maintain = s.get_bool("maintainOffset");
  Result<Matrix4> parent = RestMatrix(s, "parentMatrix");
  if (!parent.ok()) return parent.status();
  kernel.parent = *parent;
  for (int i = 0; i < s.array_size("targetMatrix"); ++i) {
    const Value* space = s.rest("targetMatrix", i);
    if (space == nullptr || space->get_if<Matrix4>() == nullptr)
      return Status::Invalid("targetMatrix[{}] has no value at rest", i);
    kernel.spaces.push_back(space->get<Matrix4>());
    Matrix4 inverse;
    if (kernel.maintain && !Invert(kernel.spaces.back(), &inverse))
      return Status::Invalid("targetMatrix[{}] is singular at rest, so that no offset can be maintained", i);
    kernel.offsets.push_back(kernel.maintain ? inverse * kernel.parent : Matrix4());
  }
  return MakeBound(std::move(kernel), 0);
}

void ComputeSpaceSwitch(SpaceContext c) {
  const auto& k = c.kernel_as<SpaceKernel>();
  const ArrayView<Matrix4> spaces = c.get<"targetMatrix">();
  const Matrix4 &in = c.get<"inMatrix">(), &parent = c.get<"parentMatrix">();
  const double blend = c.get<"blend">();
  c.out<"outMatrix">() = in;
  const double last = static_cast<double>(spaces.size()) - 1, wanted = c.get<"space">();
  if (blend == 0 || spaces.size() == 0 || !(wanted == wanted)) return;
  const double at = std::min(std::max(wanted, 0.0), last), whole = std::floor(at);
  const auto local = [&](std::uint32_t i) {
    // The parent at rest under the space at rest: where it is the parent now, nothing changes
    if (k.maintain && spaces[i] == k.spaces[i] && parent == k.parent) return in;
    return InverseOrIdentity(parent) * (spaces[i] * (k.offsets[i] * in));
  };
  const auto first = static_cast<std::uint32_t>(whole);
  Matrix4 result = local(first);
  if (at > whole) result = BlendMatrices(result, local(first + 1), at - whole);
  c.out<"outMatrix">() = BlendMatrices(in, result, blend);
}

}  // namespace

KPSA_NODES(space_switch, registry) {
  registry
      .add("spaceSwitch",
           "Carries a transform as if it hung under one of its targets, with its own motion on top.")
      .category("constraint")
      .in("targetMatrix", Matrix4(), {.doc = "world matrices of the spaces; `targets:` connects them"})
      .array()
      .in("space", 0.0,
          {.min = 0, .doc = "number of the space; between two numbers it goes from one to the next"})
      .in("inMatrix", Matrix4(), {.doc = "the local matrix below: what the clip or the rest pose says"})
      .in("parentMatrix", Matrix4(), {.doc = "worldMatrix of the constrained transform's parent"})
      .world_place()
      .in("blend", 1.0, {.min = 0, .max = 1, .doc = "0: under the parent, 1: in the space"})
      .structural("maintainOffset", true,
                  {.doc = "the spaces take over from the parent as it lies to them at rest; off: inMatrix is "
                          "taken as in the space"})
      .out("outMatrix", Type::kMatrix, "local, for the constrained transform's offsetParentMatrix")
      .compute<ComputeSpaceSwitch>()
      .bind(BindSpaceSwitch)
      .cost(400, 0);
}

}  // namespace kpsa::engine
