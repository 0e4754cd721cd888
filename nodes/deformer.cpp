#include "nodes/deformer.h"

#include <algorithm>
#include <cmath>

#include "graph/geometry.h"
#include "nodes/kernels/carried_delta.h"
#include "nodes/kernels/weights.h"

namespace kpsa::engine {
namespace {

enum class StageSpace { kWorld, kMesh };

void DeclareShared(NodeBuilder& builder) {
  builder.category("deformer");
  builder.points_in("inPoints", "the points to deform").per_geometry();
  builder.in("envelope", 1.0, {.min = 0, .max = 1, .doc = "0 leaves the points alone, 1 deforms them fully"});
  builder.in("parentMatrix", Matrix4(), {.doc = "carries the deformer's frame; `parent:` connects it"})
      .world_place();
  builder.structural("weights", Type::kAsset, {.doc = "weight map times membership; 1 where unset"})
      .per_geometry();
  builder.structural("mesh", Type::kMesh, {.doc = "the topology of the geometry"}).per_geometry();
  builder.enumeration<StageSpace>("space", {{"world", StageSpace::kWorld}, {"mesh", StageSpace::kMesh}}, true,
                                  "the space of the stage: mesh space before the skin, world space after it");
  builder
      .structural("geometryMatrix", Matrix4(),
                  {.doc = "world from mesh space at rest, for stages in mesh space"})
      .per_geometry();
}

// Where a falloff is connected: the deformer's own kernel, and what it takes to blend. Where none is, the step runs the
// deformer's own compute.
struct WithFalloff {
  std::shared_ptr<const void> kernel;
  ComputeFn compute = nullptr;
  std::size_t scratch_floats = 0;  // the kernel's own; behind them, the points as they came in
  int points = 0, falloff = 0;     // positions of the inputs
  std::vector<Index> positions;    // of the output points among those that come in; empty: the same
};

void ComputeWithFalloff(ComputeContext& c) {
  const auto& bound = c.kernel_as<WithFalloff>();
  c.kernel = bound.kernel.get();
  const ConstPointsView& in = c.slot<ConstPointsView>(bound.points);
  const PointsView& out = c.out_slot<PointsView>(0);
  const std::size_t row = PaddedCount(out.count);
  float* copy = c.scratch + bound.scratch_floats;
  const PointsView before{copy, copy + row, copy + 2 * row, out.count};  // compute may work in place
  if (bound.positions.empty()) {
    CopyPoints(in, before);
  } else {
    GatherPoints(in, bound.positions, before);
  }
  bound.compute(c);
  const float* weights = c.slot<ConstPointsView>(bound.falloff).x;
  c.host->For(out.count, 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const float w = weights[i];
      if (w == 1) continue;
      out.x[i] = w == 0 ? before.x[i] : before.x[i] + w * (out.x[i] - before.x[i]);
      out.y[i] = w == 0 ? before.y[i] : before.y[i] + w * (out.y[i] - before.y[i]);
      out.z[i] = w == 0 ? before.z[i] : before.z[i] + w * (out.z[i] - before.z[i]);
    }
  });
}

}  // namespace

NodeBuilder AddDeformer(NodeRegistry& registry, Deformer deformer, ComputeFn compute,
                        std::span<const Port> ports) {
  NodeBuilder builder = registry.add(std::move(deformer.name), std::move(deformer.doc));
  DeclareShared(builder);
  if (deformer.own) deformer.own(builder);
  builder
      .points_in("falloffWeights",
                 "a factor for what it does to each point, which may vary; `falloff: NAME` connects it",
                 Type::kWeights)
      .per_geometry();
  builder.out("outPoints", Type::kPoints, "the deformed points").per_geometry();
  builder.compute_ports(&ComputeWithFalloff, ports).in_place("inPoints");
  builder.touches("inPoints", [](const Structural& structural, const PointSet& points) {
    const std::vector<float> weights = WeightsAt(structural, points);
    return weights.empty() || std::ranges::any_of(weights, [](float w) { return w != 0; });
  });
  builder.strength("envelope");
  const int points = builder.input_position("inPoints"), falloff = builder.input_position("falloffWeights");
  builder.bind([compute, points, falloff,
                bind = std::move(deformer.bind)](const Binding& binding) -> Result<BoundKernel> {
    BoundKernel own;
    if (bind) {
      Result<BoundKernel> made = bind(binding);
      if (!made.ok()) return made.status();
      own = std::move(*made);
    }
    if (own.compute == nullptr) own.compute = compute;
    if (own.touched_points == kNoIndex) {
      const std::vector<float> weights = BoundWeights(binding);
      if (!weights.empty()) own.touched_points = TouchedPoints(weights);
    }
    if (binding.input("falloffWeights").total() == 0) return own;
    WithFalloff bound{own.object, own.compute, (own.scratch_floats + 15) / 16 * 16, points, falloff, {}};
    const PointSet &in = binding.input("inPoints"), &out = binding.output("outPoints");
    if (!(in == out)) bound.positions = in.PositionsOf(out);
    const std::size_t scratch = bound.scratch_floats + 3 * PaddedCount(out.size());
    return MakeBound(std::move(bound), scratch, own.state_bytes);
  });
  builder.demand([demand = std::move(deformer.demand)](Demand& asked) {
    const PointSet& out = asked.output("outPoints");
    if (demand) {
      demand(asked);
    } else {
      asked.Require("inPoints", 0, out);
    }
    if (asked.input_total("falloffWeights") > 0) asked.Require("falloffWeights", 0, out);
  });
  return builder;
}

std::vector<float> WeightsAt(const Structural& structural, const PointSet& points) {
  const WeightMap* map = structural.asset<WeightMap>("weights");
  if (map == nullptr) return {};
  std::vector<float> weights(points.size());
  for (Index i = 0; i < points.size(); ++i)
    weights[i] = points[i] < map->weights().size() ? map->weights()[points[i]] : 0.0f;
  return weights;
}

Index TouchedPoints(std::span<const float> weights) {
  return static_cast<Index>(std::ranges::count_if(weights, [](float w) { return w != 0; }));
}

std::vector<float> BoundWeights(const Binding& binding) {
  return WeightsAt(binding.structural(), binding.output("outPoints"));
}

Result<ConstPointsView> RestPoints(const Structural& structural) {
  const Value* rest = structural.rest("inPoints");
  if (rest == nullptr || rest->points() == nullptr) return Status::Invalid("its input has no rest shape");
  return rest->points()->view();
}

Result<Matrix4> RestMatrix(const Structural& structural, std::string_view name) {
  const Value* rest = structural.rest(name);
  if (rest == nullptr || rest->get_if<Matrix4>() == nullptr)
    return Status::Invalid("{} has no value at rest", name);
  return rest->get<Matrix4>();
}

Result<CarriedFrame> CarriedFrame::Bind(const Structural& structural) {
  CarriedFrame frame;
  Result<Matrix4> parent = RestMatrix(structural, "parentMatrix");
  if (!parent.ok()) return parent.status();
  frame.fixed_ = structural.choice<StageSpace>("space") == StageSpace::kMesh;
  frame.parent_rest_ = *parent;
  if (!Invert(*parent, &frame.parent_rest_inverse_))
    return Status::Invalid("parentMatrix is singular at rest");
  if (frame.fixed_) {
    frame.world_from_stage_ = structural.value("geometryMatrix").get<Matrix4>();
    if (!Invert(frame.world_from_stage_, &frame.stage_from_world_))
      return Status::Invalid("geometryMatrix is singular");
  }
  frame.stage_from_parent_ = frame.stage_from_world_ * frame.parent_rest_;
  return frame;
}

Matrix4 CarriedFrame::StageFromWorld(const Matrix4& parent_now) const {
  return StageFromHandle(parent_now, Matrix4());
}

Matrix4 CarriedFrame::StageFromHandle(const Matrix4& parent_now, const Matrix4& handle) const {
  if (!fixed_) return handle;
  Matrix4 frame;
  FindWaitingFrame(stage_from_parent_, parent_now, handle, &frame);
  return frame;
}

double CarriedFrame::Growth(const Matrix4& parent_now) const {
  const double growth = std::cbrt(std::fabs(Determinant3(Motion(parent_now))));
  return std::fabs(growth - 1) < 1e-9 ? 1 : growth;
}

}  // namespace kpsa::engine
