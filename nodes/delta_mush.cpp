#include "nodes/deformer.h"
#include "nodes/kernels/delta_mush.h"
#include "nodes/mesh_topology.h"
#include "nodes/standard_nodes.h"

namespace kpsa {
namespace {

DeltaMushSettings Settings(const Structural& s) {
  return {s.get_int("iterations"), s.get_double("smoothingStep"), s.get_double("distanceWeight"), s.get_bool("pinBorderVertices")};
}

std::vector<float> WeightsAt(const Structural& s, const PointSet& out) {
  const auto* map = s.asset<WeightMap>("weights");
  std::vector<float> weights;
  if (map == nullptr) return weights;
  for (Index i = 0; i < out.size(); ++i) weights.push_back(out[i] < map->weights().size() ? map->weights()[out[i]] : 0.0f);
  return weights;
}

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
  demand.Require("inPoints", 0, PointSet::Of(DeltaMushDemand(*topology, Settings(s), out.ToVector(), WeightsAt(s, out)), out.total()));
}

Result<BoundKernel> BindMush(const Binding& binding) {
  const Structural& s = binding.structural();
  const DeltaMushSettings settings = Settings(s);
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
  DeltaMushKernel kernel(*topology, *rest, settings, out.ToVector(), in.ToVector(), WeightsAt(s, out));
  const std::size_t scratch = kernel.ScratchFloats();
  return MakeBound(std::move(kernel), scratch);
}

void ComputeMush(ComputeContext& c) {
  const auto& kernel = c.kernel_as<DeltaMushKernel>();
  const Parallel parallel = HostParallel(c);
  kernel.Run({c.get<double>(kEnvelope), c.get<double>(kFirstOwnInput)}, c.points(kInPoints), c.out_points(0),
             {c.scratch, kernel.ScratchFloats()}, &parallel);
}

}  // namespace

void AddDeltaMushNode(NodeRegistry& registry) {
  NodeBuilder b = AddDeformer(registry, "deltaMush", "Smooths the points and gives the rest shape's detail back.");
  b.in("displacement", 1.0, {.min = 0, .max = 2, .doc = "how much of the detail comes back"});
  b.structural("iterations", 10, {.min = 0, .max = 200, .doc = "smoothing steps"});
  b.structural("smoothingStep", 0.5, {.min = 0, .max = 1, .doc = "how far a point goes to its neighbours' mean in a step"});
  b.structural("distanceWeight", 0.0, {.min = 0, .max = 1, .doc = "0: all neighbours alike; 1: near ones weigh more"});
  b.structural("pinBorderVertices", true, {.doc = "points on borders keep their place"});
  FinishDeformer(b, &ComputeMush, BindMush, DemandMush).cost(500, 80);
}

}  // namespace kpsa
