#include "nodes/kernels/delta_mush.h"

#include "base/matrix.h"
#include "nodes/deformer.h"
#include "nodes/delta_mush_step.h"
#include "nodes/mesh_topology.h"
#include "nodes/node_file.h"

namespace kpsa::engine {
namespace {

// What it costs (bench_kernels): a run, a point that comes out, and a point that is smoothed once.
constexpr float kMushNs = 500, kFrameNs = 8, kStepNs = 1.6f;

// iterations + 1 rings: the frames read smoothed neighbours.
void DemandMush(Demand& demand) {
  const Structural& s = demand.structural();
  const PointSet& out = demand.output("outPoints");
  Status error;
  const Topology* topology = TopologyOf(s.asset<Mesh>("mesh"), &error);
  if (topology == nullptr || topology->point_count() != out.total() || out.is_all()) {
    demand.Require("inPoints", 0, PointSet::All(out.total()));  // bind reports what is wrong
    return;
  }
  demand.Require("inPoints", 0,
                 PointSet::Of(DeltaMushDemand(*topology, MushSettings(s), out.ToVector(), WeightsAt(s, out)),
                              out.total()));
}

// The pivot, for precision far from the origin: the middle of the rest shape, carried by parentMatrix. It
// does not depend on the binding.
struct MushBound {
  DeltaMushKernel kernel;
  CarriedFrame frame;
  Double3 middle;
};

Result<BoundKernel> BindMush(const Binding& binding) {
  const Structural& s = binding.structural();
  const DeltaMushSettings settings = MushSettings(s);
  KPSA_RETURN_IF_ERROR(settings.Validate());
  const PointSet &out = binding.output("outPoints"), &in = binding.input("inPoints");
  Status error;
  const Topology* topology = TopologyOf(s.asset<Mesh>("mesh"), &error);
  if (topology == nullptr) return error;
  if (topology->point_count() != out.total()) {
    return Status::Invalid("its mesh has {} points, the geometry {}", topology->point_count(), out.total());
  }
  Result<ConstPointsView> rest = RestPoints(s);
  if (!rest.ok()) return rest.status();
  Result<CarriedFrame> frame = CarriedFrame::Bind(s);
  if (!frame.ok()) return frame.status();
  const Double3 middle = MiddleOf(*rest);
  MushBound bound{
      DeltaMushKernel(*topology, *rest, settings, out.ToVector(), in.ToVector(), WeightsAt(s, out), middle),
      *frame, middle};
  const std::size_t scratch = bound.kernel.ScratchFloats();
  // A few points smooth many times as many around them
  const float ns = kMushNs + kFrameNs * static_cast<float>(bound.kernel.point_count()) +
                   kStepNs * static_cast<float>(bound.kernel.SmoothingSteps());
  BoundKernel made = MakeBound(std::move(bound), scratch);
  made.cost_ns = ns;
  return made;
}

void ComputeMush(DeformerContext<In<"displacement", double>> c) {
  const auto& bound = c.kernel_as<MushBound>();
  const Matrix4& parent = c.get<"parentMatrix">();
  const Double3 pivot = TransformPoint(bound.frame.Motion(parent), bound.middle);
  const Parallel parallel = HostParallel(c);
  bound.kernel.Run({c.get<"envelope">(), c.get<"displacement">() * bound.frame.Growth(parent), pivot},
                   c.get<"inPoints">(), c.out<"outPoints">(), {c.scratch(), bound.kernel.ScratchFloats()},
                   &parallel);
}

void DeclareMush(NodeBuilder& b) {
  b.in("displacement", 1.0, {.min = 0, .max = 2, .doc = "how much of the detail comes back"});
  b.structural("iterations", 10, {.min = 0, .max = 200, .doc = "smoothing steps"});
  b.structural("smoothingStep", 0.5,
               {.min = 0, .max = 1, .doc = "how far a point goes to its neighbours' mean in a step"});
  b.structural("distanceWeight", 0.0,
               {.min = 0, .max = 1, .doc = "0: all neighbours alike; 1: near ones weigh more"});
  b.structural("pinBorderVertices", true, {.doc = "points on borders keep their place"});
}

}  // namespace

KPSA_NODES(delta_mush, registry) {
  AddDeformer<ComputeMush>(registry, {.name = "deltaMush",
                                      .doc = "Smooths the points and gives the rest shape's detail back.",
                                      .own = DeclareMush,
                                      .bind = BindMush,
                                      .demand = DemandMush})
      .version(2)  // detail that fades in folds and grows with its parent
      .cost(kMushNs, kFrameNs + 10 * kStepNs)
      .last_step(MushLastStep);
}

}  // namespace kpsa::engine
