// cluster and softMod: a handle moves weighted points. Only the handle's own motion acts, relative to its
// parent: a handle that hangs under the head does not move the face twice when the head turns.
#include <algorithm>

#include "graph/geometry.h"
#include "nodes/deformer.h"
#include "nodes/kernels/carried_delta.h"
#include "nodes/kernels/soft_mod.h"
#include "nodes/kernels/weights.h"
#include "nodes/node_file.h"

namespace kpsa::engine {
namespace {

using ClusterContext = DeformerContext<In<"matrix", Matrix4>, In<"bindPreMatrix", Matrix4>>;

struct ClusterBound {
  ClusterKernel kernel;
  CarriedFrame frame;
  bool has_bind_pre = false;
  Double3 pivot;        // of the handle at rest, stage space
  CarriedRest carried;  // of stages in world space
  WaitingRest
      waiting;  // of stages in mesh space: the handle's motion in its parent's frame, from where that rests
};

Result<ClusterBound> MakeCluster(const Binding& binding, std::vector<float> weights) {
  const Structural& s = binding.structural();
  Result<CarriedFrame> frame = CarriedFrame::Bind(s);
  if (!frame.ok()) return frame.status();
  Result<Matrix4> handle = RestMatrix(s, "matrix");
  if (!handle.ok()) return handle.status();
  ClusterBound bound{ClusterKernel(binding.output("outPoints").ToVector(), weights),
                     *frame,
                     s.is_set("bindPreMatrix"),
                     TransformPoint(frame->stage_from_world(), TransformPoint(*handle, {})),
                     {},
                     {}};
  Matrix4 handle_inverse;
  if (!Invert(*handle, &handle_inverse)) return Status::Invalid("matrix is singular at rest");
  bound.carried = {handle_inverse * frame->parent_rest(),
                   TransformPoint(frame->parent_rest_inverse(), bound.pivot)};
  bound.waiting = {frame->stage_from_world() * frame->parent_rest(),
                   handle_inverse * frame->world_from_stage(), bound.pivot};
  return bound;
}

Result<BoundKernel> BindCluster(const Binding& binding) {
  Result<ClusterBound> bound = MakeCluster(binding, BoundWeights(binding));
  if (!bound.ok()) return bound.status();
  return MakeBound(std::move(*bound), 0);
}

// In the order of Maya's, which the kernel does not know.
enum class SoftModCurve { kSmooth, kLinear, kSpline, kNone };

FalloffCurve CurveOf(SoftModCurve curve) {
  switch (curve) {
    case SoftModCurve::kSmooth:
      return FalloffCurve::kSmooth;
    case SoftModCurve::kLinear:
      return FalloffCurve::kLinear;
    case SoftModCurve::kSpline:
      return FalloffCurve::kSpline;
    case SoftModCurve::kNone:
      break;
  }
  return FalloffCurve::kNone;
}

// Falloff and weight map at some points.
Result<std::vector<float>> SoftModWeights(const Structural& s, const PointSet& points) {
  Result<ConstPointsView> rest = RestPoints(s);
  if (!rest.ok()) return rest.status();
  Result<Matrix4> handle = RestMatrix(s, "matrix");
  if (!handle.ok()) return handle.status();
  Result<CarriedFrame> frame = CarriedFrame::Bind(s);
  if (!frame.ok()) return frame.status();
  const Double3 world =
      s.is_set("falloffCenter") ? s.value("falloffCenter").get<Double3>() : TransformPoint(*handle, {});
  FalloffProfile profile;
  profile.curve = CurveOf(s.choice<SoftModCurve>("falloffCurve"));
  // Distances are world ones: a stage in mesh space may be scaled
  const double scale = frame->WorldScale();
  const std::vector<float> falloff =
      RadialFalloff(*rest, points.ToVector(), TransformPoint(frame->stage_from_world(), world),
                    s.get_double("falloffRadius") / scale, profile);
  return MultiplyWeights(falloff, WeightsAt(s, points));
}

Result<BoundKernel> BindSoftMod(const Binding& binding) {
  Result<std::vector<float>> weights = SoftModWeights(binding.structural(), binding.output("outPoints"));
  if (!weights.ok()) return weights.status();
  const Index touched = TouchedPoints(*weights);
  Result<ClusterBound> bound = MakeCluster(binding, std::move(*weights));
  if (!bound.ok()) return bound.status();
  BoundKernel made = MakeBound(std::move(*bound), 0);
  made.touched_points = touched;
  return made;
}

void ComputeCluster(ClusterContext c) {
  const auto& bound = c.kernel_as<ClusterBound>();
  const Matrix4 &parent = c.get<"parentMatrix">(), &handle = c.get<"matrix">();
  AffineDelta delta;
  if (bound.has_bind_pre) {
    const Matrix4 motion = bound.frame.Motion(parent);
    delta = MakeAffineDelta(handle * c.get<"bindPreMatrix">(), TransformPoint(motion, bound.pivot));
  } else if (bound.frame.fixed()) {  // the points wait for the skin: the parent stays where it rests
    FindWaitingDelta(handle, parent, bound.waiting, &delta);
  } else {
    FindCarriedDelta(handle, parent, bound.carried, &delta);
  }
  const Parallel parallel = HostParallel(c);
  bound.kernel.Run(delta, c.get<"envelope">(), c.get<"inPoints">(), c.out<"outPoints">(), &parallel);
}

void DeclareHandle(NodeBuilder& b) {
  b.in("matrix", Matrix4(), {.doc = "the handle's world matrix"});
  b.in("bindPreMatrix", Matrix4(),
       {.doc =
            "inverse of the handle's matrix at bind; default: from the rest state, carried by parentMatrix"});
}

void DeclareSoftMod(NodeBuilder& b) {
  DeclareHandle(b);
  b.structural("falloffCenter", Double3(),
               {.unit = Unit::kLength, .doc = "world space at rest; default: the handle"});
  b.structural("falloffRadius", 0.05, {.min = 0, .unit = Unit::kLength});
  b.enumeration<SoftModCurve>("falloffCurve",
                              {{"smooth", SoftModCurve::kSmooth},
                               {"linear", SoftModCurve::kLinear},
                               {"spline", SoftModCurve::kSpline},
                               {"none", SoftModCurve::kNone}},
                              true);
}

}  // namespace

KPSA_NODES(cluster, registry) {
  AddDeformer<ComputeCluster>(registry, {.name = "cluster",
                                         .doc = "Moves weighted points with a handle.",
                                         .own = DeclareHandle,
                                         .bind = BindCluster})
      .cost(40, 0.25f);
  AddDeformer<ComputeCluster>(registry,
                              {.name = "softMod",
                               .doc = "Moves points with a handle, fading with the distance from a centre.",
                               .own = DeclareSoftMod,
                               .bind = BindSoftMod})
      .cost(40, 0.25f)
      .touches("inPoints", [](const Structural& structural, const PointSet& points) {
        const Result<std::vector<float>> weights = SoftModWeights(structural, points);
        return !weights.ok() || std::ranges::any_of(*weights, [](float w) { return w != 0; });
      });
}

}  // namespace kpsa::engine
