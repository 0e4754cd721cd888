// curve: control vertices that hang under a parent and are offset in its axes. wire: points near a curve
// follow its offsets.
#include <algorithm>
#include <string>

#include "graph/geometry.h"
#include "nodes/deformer.h"
#include "nodes/kernels/wire.h"
#include "nodes/node_file.h"

namespace kpsa::engine {
namespace {

Value RestOffsets(const Structural& s) {
  const auto* curve = s.asset<Curve>("curve");
  return Value(PointBufferPtr(std::make_shared<PointBuffer>(curve == nullptr ? 0 : curve->cvs().size())));
}

void ComputeDisplacements(
    NodeContext<In<"cv", ConstPointsView>, In<"parentMatrix", Matrix4>, Out<"displacements", PointsView>> c) {
  const ConstPointsView& cv = c.get<"cv">();
  const PointsView& out = c.out<"displacements">();
  const Matrix4& parent = c.get<"parentMatrix">();
  for (std::size_t i = 0; i < out.count; ++i) {
    const Double3 d = TransformVector(parent, {cv.x[i], cv.y[i], cv.z[i]});
    out.x[i] = static_cast<float>(d.x);
    out.y[i] = static_cast<float>(d.y);
    out.z[i] = static_cast<float>(d.z);
  }
}

void ComputeWorldMatrix(NodeContext<In<"parentMatrix", Matrix4>, Out<"worldMatrix", Matrix4>> c) {
  c.out<"worldMatrix">() = c.get<"parentMatrix">();
}

using WireContext =
    DeformerContext<In<"displacements", ConstPointsView>, In<"deformedWire", ArrayView<ConstPointsView>>>;

struct WireBound {
  WireKernel kernel;
  CarriedFrame frame;
  std::size_t view_floats = 0;  // of several curves: their displacements in a row
  bool several = false;
};

// The curves of a wire: its own, or those of baseWire.
struct WireSource {
  const Curve* curve = nullptr;
  double dropoff = 0;
  std::size_t displacements = 0;
  std::string input;  // that has them, for messages
};

std::vector<WireSource> Sources(const Binding& binding) {
  const Structural& s = binding.structural();
  const int several = s.array_size("baseWire");
  if (several == 0) {
    return {{s.asset<Curve>("curve"), s.get_double("dropoff"), binding.input("displacements", -1).size(),
             "displacements"}};
  }
  std::vector<WireSource> sources;
  for (int i = 0; i < several; ++i) {
    const double dropoff =
        s.is_set("dropoffDistance", i) ? s.value("dropoffDistance", i).AsDouble() : s.get_double("dropoff");
    sources.push_back({s.asset<Curve>("baseWire", i), dropoff, binding.input("deformedWire", i).size(),
                       "deformedWire[" + std::to_string(i) + "]"});
  }
  return sources;
}

Result<BoundKernel> BindWire(const Binding& binding) {
  const Structural& s = binding.structural();
  const int curve_count = s.array_size("baseWire");
  const bool several = curve_count > 0;
  if (several && s.array_size("deformedWire") != curve_count) {
    return Status::Invalid("deformedWire has {} elements for {} curves", s.array_size("deformedWire"),
                           curve_count);
  }
  if (several && s.array_size("dropoffDistance") > curve_count) {
    return Status::Invalid("dropoffDistance has {} elements for {} curves", s.array_size("dropoffDistance"),
                           curve_count);
  }
  Result<ConstPointsView> rest = RestPoints(s);
  if (!rest.ok()) return rest.status();
  Result<CarriedFrame> frame = CarriedFrame::Bind(s);
  if (!frame.ok()) return frame.status();
  const double scale = frame->WorldScale();
  const std::vector<WireSource> sources = Sources(binding);
  std::vector<std::vector<Double3>> vertices;
  std::vector<WireSettings> settings;
  for (const WireSource& source : sources) {
    if (source.curve == nullptr) return Status::Invalid("curve is not set");
    if (source.displacements != source.curve->cvs().size()) {
      return Status::Invalid("{}: {} given for a curve of {} vertices; connect the curve's displacements",
                             source.input, source.displacements, source.curve->cvs().size());
    }
    vertices.emplace_back();
    for (const Double3& cv : source.curve->cvs())
      vertices.back().push_back(TransformPoint(frame->stage_from_world(), cv));
    settings.emplace_back();
    settings.back().closed = source.curve->closed();
    settings.back().dropoff = source.dropoff / scale;
    KPSA_RETURN_IF_ERROR(WireKernel::Validate(settings.back(), vertices.back()));
  }
  const std::vector<Index> out = binding.output("outPoints").ToVector();
  std::vector<WireCurve> curves;
  for (std::size_t i = 0; i < sources.size(); ++i) curves.push_back({settings[i], vertices[i]});
  WireBound bound{several
                      ? WireKernel(curves, s.get_double("crossingEffect"), *rest, out, BoundWeights(binding))
                      : WireKernel(settings[0], vertices[0], *rest, out, BoundWeights(binding)),
                  *frame, 0, several};
  if (several) bound.view_floats = PaddedCount(curves.size() * sizeof(ConstPointsView) / sizeof(float));
  const std::size_t scratch = bound.view_floats + bound.kernel.ScratchFloats();
  const auto touched = static_cast<Index>(bound.kernel.affected_points());
  BoundKernel made = MakeBound(std::move(bound), scratch);
  made.touched_points = touched;
  return made;
}

void ComputeWire(WireContext c) {
  const auto& bound = c.kernel_as<WireBound>();
  std::span<const ConstPointsView> offsets(&c.get<"displacements">(), 1);
  if (bound.several) {
    const ArrayView<ConstPointsView> wires = c.get<"deformedWire">();
    auto* views = reinterpret_cast<ConstPointsView*>(c.scratch());
    for (std::uint32_t i = 0; i < wires.size(); ++i) views[i] = wires[i];
    offsets = {views, wires.size()};
  }
  // In mesh space the skin turns offsets later: take the parent's turn out again
  const bool turns = bound.frame.fixed();
  Matrix4 turn;
  if (turns) turn = bound.frame.StageFromWorld(c.get<"parentMatrix">());
  const Parallel parallel = HostParallel(c);
  bound.kernel.Run({offsets, c.get<"envelope">(), turns ? &turn : nullptr}, c.get<"inPoints">(),
                   c.out<"outPoints">(), {c.scratch() + bound.view_floats, bound.kernel.ScratchFloats()},
                   &parallel);
}

void DemandWire(Demand& demand) {
  demand.Require("inPoints", 0, demand.output("outPoints"));
  const int several = demand.structural().array_size("baseWire");
  if (several == 0)
    demand.Require("displacements", -1, PointSet::All(demand.input_total("displacements", -1)));
  for (int i = 0; i < std::min(several, demand.structural().array_size("deformedWire")); ++i)
    demand.Require("deformedWire", i, PointSet::All(demand.input_total("deformedWire", i)));
}

void DeclareWire(NodeBuilder& b) {
  b.points_in("displacements", "the curve's displacements");
  b.points_in("deformedWire", "of several curves, in place of displacements; `curves:` connects them")
      .array();
  b.structural("curve", Type::kCurve, {.doc = "the curve at rest"});
  b.structural(
      "dropoff", 0.02,
      {.min = 1e-6, .unit = Unit::kLength, .doc = "distance from the curve where its influence ends"});
  b.structural("baseWire", Type::kCurve, {.doc = "several curves at rest, in place of curve"}).array();
  b.structural(
       "dropoffDistance", 0.02,
       {.min = 1e-6, .unit = Unit::kLength, .doc = "dropoff of each of several curves; default: dropoff"})
      .array();
  b.structural(
      "crossingEffect", 0.0,
      {.min = 0, .max = 1, .doc = "of several curves: 0 near ones take over from far ones, 1 they add up"});
}

}  // namespace

KPSA_NODES(curve, registry) {
  registry.add("curve", "A curve for wires, through control vertices.")
      .category("geometry")
      .structural("curve", Type::kCurve, {.doc = "the vertices at rest, world space"})
      .points_in("cv", "offsets of the vertices from rest, in the parent's axes")
      .unit(Unit::kLength)
      .default_from(RestOffsets)
      .in("parentMatrix", Matrix4(), {.doc = "turns the offsets, carries the curve; `parent:` connects it"})
      .world_place()
      .out("displacements", Type::kPoints, "the offsets in world axes")
      .unit(Unit::kLength)
      .out("worldMatrix", Type::kMatrix, "parentMatrix, which carries the curve")
      .compute<ComputeDisplacements>()
      .cost(20, 4)
      .compute<ComputeWorldMatrix>()
      .cost(10, 0);
  AddDeformer<ComputeWire>(registry, {.name = "wire",
                                      .doc = "Points near a curve, or near several, follow it.",
                                      .own = DeclareWire,
                                      .bind = BindWire,
                                      .demand = DemandWire})
      .cost(35, 2.4f);
}

}  // namespace kpsa::engine
