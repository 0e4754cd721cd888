// curve: control vertices that are offset in the axes of a parent. wire: points near a curve follow its
// offsets.
#include <cmath>

#include "graph/geometry.h"
#include "nodes/deformer.h"
#include "nodes/kernels/wire.h"
#include "nodes/standard_nodes.h"

namespace kpsa {
namespace {

Value RestOffsets(const Structural& s) {
  const auto* curve = s.asset<Curve>("curve");
  return Value(PointBufferPtr(std::make_shared<PointBuffer>(curve == nullptr ? 0 : curve->cvs().size())));
}

void ComputeDisplacements(ComputeContext& c) {
  const ConstPointsView& cv = c.points(0);
  const PointsView& out = c.out_points(0);
  const Matrix4& parent = c.get<Matrix4>(1);
  for (std::size_t i = 0; i < out.count; ++i) {
    const Double3 d = TransformVector(parent, {cv.x[i], cv.y[i], cv.z[i]});
    out.x[i] = static_cast<float>(d.x);
    out.y[i] = static_cast<float>(d.y);
    out.z[i] = static_cast<float>(d.z);
  }
}

struct WireBound {
  WireKernel kernel;
  Matrix4 stage_from_world;  // for stages in mesh space: with the parent's motion taken out
  CarriedFrame frame;
  std::size_t vertices, offset_floats;
};

Result<BoundKernel> BindWire(const Binding& binding) {
  const Structural& s = binding.structural();
  const auto* curve = s.asset<Curve>("curve");
  if (curve == nullptr) return Status::Invalid("curve is not set");
  if (binding.input("displacements", -1).size() != curve->cvs().size()) {
    return Status::Invalid(
        "displacements: {} given for a curve of {} vertices; connect the curve's displacements",
        binding.input("displacements", -1).size(), curve->cvs().size());
  }
  Result<ConstPointsView> rest = RestPoints(s);
  if (!rest.ok()) return rest.status();
  Result<CarriedFrame> frame = CarriedFrame::Bind(s);
  if (!frame.ok()) return frame.status();
  std::vector<Double3> vertices;
  for (const Double3& cv : curve->cvs()) vertices.push_back(TransformPoint(frame->stage_from_world(), cv));
  WireSettings settings;
  settings.closed = curve->closed();
  settings.dropoff = s.get_double("dropoff") / std::cbrt(std::fabs(Determinant3(frame->world_from_stage())));
  KPSA_RETURN_IF_ERROR(WireKernel::Validate(settings, vertices));
  WireBound bound{
      WireKernel(settings, vertices, *rest, binding.output("outPoints").ToVector(), BoundWeights(binding)),
      frame->stage_from_world(), *frame, vertices.size(), 0};
  bound.offset_floats = (vertices.size() * sizeof(Double3) / sizeof(float) + 15) / 16 * 16;
  const std::size_t scratch = bound.offset_floats + bound.kernel.ScratchFloats();
  return MakeBound(std::move(bound), scratch);
}

void ComputeWire(ComputeContext& c) {
  const auto& bound = c.kernel_as<WireBound>();
  const ConstPointsView& displacements = c.points(kFirstOwnInput);
  auto* offsets = reinterpret_cast<Double3*>(c.scratch);
  // In mesh space the skin turns offsets later: take the parent's turn out again
  const Matrix4 turn = bound.frame.fixed() ? bound.stage_from_world * bound.frame.parent_rest() *
                                                 InverseOrIdentity(c.get<Matrix4>(kParentMatrix))
                                           : Matrix4();
  for (std::size_t i = 0; i < bound.vertices; ++i) {
    offsets[i] = TransformVector(turn, {displacements.x[i], displacements.y[i], displacements.z[i]});
  }
  const Parallel parallel = HostParallel(c);
  bound.kernel.Run({{offsets, bound.vertices}, c.get<double>(kEnvelope)}, c.points(kInPoints),
                   c.out_points(0), {c.scratch + bound.offset_floats, bound.kernel.ScratchFloats()},
                   &parallel);
}

void DemandWire(Demand& demand) {
  demand.Require("inPoints", 0, demand.output("outPoints"));
  demand.Require("displacements", -1, PointSet::All(demand.input_total("displacements", -1)));
}

}  // namespace

void AddCurveNodes(NodeRegistry& registry) {
  registry.add("curve", "A curve for wires, through control vertices.")
      .category("geometry")
      .structural("curve", Type::kCurve, {.doc = "the vertices at rest, world space"})
      .points_in("cv", "offsets of the vertices from rest, in the parent's axes")
      .unit(Unit::kLength)
      .default_from(RestOffsets)
      .in("parentMatrix", Matrix4(), {.doc = "turns the offsets; `parent:` connects it"})
      .out("displacements", Type::kPoints, "the offsets in world axes")
      .unit(Unit::kLength)
      .compute(&ComputeDisplacements);
  NodeBuilder b = AddDeformer(registry, "wire", "Points near a curve follow it.");
  b.points_in("displacements", "the curve's displacements");
  b.structural("curve", Type::kCurve, {.doc = "the curve at rest"});
  b.structural(
      "dropoff", 0.02,
      {.min = 1e-6, .unit = Unit::kLength, .doc = "distance from the curve where its influence ends"});
  FinishDeformer(b, &ComputeWire, BindWire, DemandWire).cost(300, 6);
}

}  // namespace kpsa
