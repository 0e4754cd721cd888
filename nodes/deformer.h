// What all deformers share: geometry in and out, envelope, weight map and membership, and the frame that
// `parent:` gives them.
//
// A deformer serves several geometries; everything per geometry is an array whose element i belongs to
// geometry i. Spaces: a stage after skinCluster works in world space, and its frame is carried by
// parentMatrix. A stage before it works in mesh space; there the frame stays where it is at rest, because the
// skin carries it later.
#pragma once

#include <cmath>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/matrix.h"
#include "graph/node_registry.h"
#include "nodes/kernels/parallel_hook.h"

namespace kpsa::engine {

// What a deformer's compute sees: the shared inputs, its own, and the points that it writes, which may be in
// the buffer that they come in.
template <typename... Own>
using DeformerContext =
    NodeContext<In<"inPoints", ConstPointsView>, In<"envelope", double>, In<"parentMatrix", Matrix4>, Own...,
                In<"falloffWeights", ConstPointsView>, Out<"outPoints", PointsView>>;

// A deformer in one piece.
struct Deformer {
  std::string name, doc;
  // Declares its own attributes: inputs, and outputs beside the points with their computes.
  std::function<void(NodeBuilder&)> own = nullptr;
  BindFn bind = nullptr;      // null: no kernel
  DemandFn demand = nullptr;  // null: local
};

NodeBuilder AddDeformer(NodeRegistry& registry, Deformer deformer, ComputeFn compute,
                        std::span<const Port> ports);
// Declares inPoints, envelope, parentMatrix, weights, mesh, space and geometryMatrix, the deformer's own, then
// falloffWeights, outPoints and their group; kCompute is a function of a DeformerContext that names its own
// inputs. Where falloffWeights w are connected, the points are in + w (out - in) of what it gives: its own
// kernel knows nothing of them, and nothing is spent where they are not. Every kernel leaves points of weight 0
// as they are, bit for bit, so where only such points are wanted, the node does not run.
template <auto kCompute>
NodeBuilder AddDeformer(NodeRegistry& registry, Deformer deformer) {
  using Context = ContextOf<decltype(kCompute)>;
  return AddDeformer(
      registry, std::move(deformer), [](ComputeContext& context) { kCompute(Context(context)); },
      Context::kPorts);
}

// The weight map at these points (empty: 1 everywhere); for bind, at the output points.
std::vector<float> WeightsAt(const Structural& structural, const PointSet& points);
std::vector<float> BoundWeights(const Binding& binding);
// How many of them are not 0: BoundKernel::touched_points.
Index TouchedPoints(std::span<const float> weights);
// The whole geometry at this stage with everything at its default; an error where upstream could not be
// evaluated.
Result<ConstPointsView> RestPoints(const Structural& structural);
Result<Matrix4> RestMatrix(const Structural& structural, std::string_view name);

// How the frame of the stage has moved since rest: parentMatrix now times its rest inverse, or the identity
// for stages in mesh space.
class CarriedFrame {
 public:
  CarriedFrame() = default;
  static Result<CarriedFrame> Bind(const Structural& structural);
  Matrix4 Motion(const Matrix4& parent_now) const {
    return fixed_ ? Matrix4() : parent_now * parent_rest_inverse_;
  }
  // From the world to the stage: what hangs under the parent is taken to where the parent rests, because in
  // mesh space the skin carries the points later. The identity for stages in world space.
  Matrix4 StageFromWorld(const Matrix4& parent_now) const;
  // The same of a handle, whose matrix is of the world. Against its parent first: where it follows that, it
  // stays where it is but for the rounding of that.
  Matrix4 StageFromHandle(const Matrix4& parent_now, const Matrix4& handle) const;
  // How much larger the parent has become since rest, along one axis; a rigid motion gives exactly 1.
  double Growth(const Matrix4& parent_now) const;
  bool fixed() const { return fixed_; }
  const Matrix4& parent_rest() const { return parent_rest_; }
  const Matrix4& parent_rest_inverse() const { return parent_rest_inverse_; }
  // world_from_stage at rest; the identity for stages in world space.
  const Matrix4& world_from_stage() const { return world_from_stage_; }
  const Matrix4& stage_from_world() const { return stage_from_world_; }
  // World lengths of a length 1 in the stage.
  double WorldScale() const { return std::cbrt(std::fabs(Determinant3(world_from_stage_))); }

 private:
  bool fixed_ = false;
  Matrix4 parent_rest_, parent_rest_inverse_, world_from_stage_, stage_from_world_, stage_from_parent_;
};

// The host's threads as kernels want them.
template <typename... Ports>
Parallel HostParallel(NodeContext<Ports...> c) {
  return {[](void* self, std::size_t count, std::size_t grain, RangeBody body) {
            static_cast<ComputeHost*>(self)->For(count, grain, body);
          },
          c.context().host};
}

// A kernel and what its adapter keeps beside it, as the engine wants it.
template <typename T>
BoundKernel MakeBound(T object, std::size_t scratch_floats, std::size_t state_bytes = 0) {
  return BoundKernel{.object = std::make_shared<const T>(std::move(object)),
                     .scratch_floats = scratch_floats,
                     .state_bytes = state_bytes,
                     .object_bytes = sizeof(T)};
}

}  // namespace kpsa::engine
