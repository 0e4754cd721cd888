// tension: where the surface is stretched or compressed, and a push along the normals by it.
#include "nodes/kernels/tension.h"

#include <algorithm>

#include "nodes/deformer.h"
#include "nodes/mesh_topology.h"
#include "nodes/node_file.h"

namespace kpsa::engine {
namespace {

using PushContext = DeformerContext<In<"compressScale", double>, In<"stretchScale", double>>;
using StrainInputs = NodeContext<In<"inPoints", ConstPointsView>, In<"parentMatrix", Matrix4>>;

struct PushBound {
  TensionPushKernel kernel;
  CarriedFrame frame;
};
struct StrainBound {
  StrainKernel kernel;
  CarriedFrame frame;
  std::size_t strain_floats;
};

std::vector<float> WeightsOf(const Structural& s, const PointSet& out) {
  const auto* map = s.asset<WeightMap>("weights");
  std::vector<float> weights;
  for (Index i = 0; map != nullptr && i < out.size(); ++i)
    weights.push_back(out[i] < map->weights().size() ? map->weights()[out[i]] : 0.0f);
  return weights;
}

// One ring of what an output needs; its measures know no weights.
void DemandRing(Demand& demand, const char* output, bool weighted) {
  const Structural& s = demand.structural();
  const PointSet& out = demand.output(output);
  Status error;
  const Topology* topology = TopologyOf(s.asset<Mesh>("mesh"), &error);
  if (topology == nullptr || topology->point_count() != out.total() || out.is_all()) {
    demand.Require("inPoints", 0, PointSet::All(out.total()));  // bind reports what is wrong
    return;
  }
  demand.Require("inPoints", 0,
                 PointSet::Of(TensionDemand(*topology, out.ToVector(),
                                            weighted ? WeightsOf(s, out) : std::vector<float>()),
                              out.total()));
}

// What both kernels are made of.
struct Surface {
  const Topology* topology = nullptr;
  ConstPointsView rest;
  CarriedFrame frame;
};

Result<Surface> SurfaceOf(const Structural& s, Index points) {
  Surface surface;
  Status error;
  surface.topology = TopologyOf(s.asset<Mesh>("mesh"), &error);
  if (surface.topology == nullptr) return error;
  if (surface.topology->point_count() != points) {
    return Status::Invalid("its mesh has {} points, the geometry {}", surface.topology->point_count(),
                           points);
  }
  Result<ConstPointsView> rest = RestPoints(s);
  if (!rest.ok()) return rest.status();
  Result<CarriedFrame> frame = CarriedFrame::Bind(s);
  if (!frame.ok()) return frame.status();
  surface.rest = *rest;
  surface.frame = *frame;
  return surface;
}

Result<BoundKernel> BindPush(const Binding& binding) {
  const PointSet& out = binding.output("outPoints");
  Result<Surface> surface = SurfaceOf(binding.structural(), out.total());
  if (!surface.ok()) return surface.status();
  PushBound bound{
      TensionPushKernel(*surface->topology, surface->rest, out.ToVector(),
                        binding.input("inPoints").ToVector(), WeightsOf(binding.structural(), out)),
      surface->frame};
  const std::size_t scratch = bound.kernel.ScratchFloats();
  return MakeBound(std::move(bound), scratch);
}

template <bool kStretch>
Result<BoundKernel> BindStrain(const Binding& binding) {
  const PointSet& out = binding.output(kStretch ? "stretch" : "compress");
  Result<Surface> surface = SurfaceOf(binding.structural(), out.total());
  if (!surface.ok()) return surface.status();
  const std::size_t scratch = PaddedCount(out.size());
  return MakeBound(StrainBound{StrainKernel(*surface->topology, surface->rest, out.ToVector(),
                                            binding.input("inPoints").ToVector()),
                               surface->frame, scratch},
                   scratch);
}

void ComputePush(PushContext c) {
  const auto& bound = c.kernel_as<PushBound>();
  const Parallel parallel = HostParallel(c);
  bound.kernel.Run({bound.frame.Growth(c.get<"parentMatrix">()), c.get<"compressScale">(),
                    c.get<"stretchScale">(), c.get<"envelope">()},
                   c.get<"inPoints">(), c.out<"outPoints">(), {c.scratch(), bound.kernel.ScratchFloats()},
                   &parallel);
}

// The strain with that sign, where it is positive.
void ComputeStrain(StrainInputs c, float sign, const PointsView& out) {
  const auto& bound = c.kernel_as<StrainBound>();
  const Parallel parallel = HostParallel(c);
  bound.kernel.Run(bound.frame.Growth(c.get<"parentMatrix">()), c.get<"inPoints">(), c.scratch(), &parallel);
  for (std::size_t i = 0; i < out.count; ++i) {
    const float strain = sign * c.scratch()[i];
    out.x[i] = strain > 0 ? strain : 0.0f;
  }
}
void ComputeStretch(
    NodeContext<In<"inPoints", ConstPointsView>, In<"parentMatrix", Matrix4>, Out<"stretch", PointsView>> c) {
  ComputeStrain(c, 1, c.out<"stretch">());
}
void ComputeCompress(
    NodeContext<In<"inPoints", ConstPointsView>, In<"parentMatrix", Matrix4>, Out<"compress", PointsView>>
        c) {
  ComputeStrain(c, -1, c.out<"compress">());
}

void DeclareTension(NodeBuilder& b) {
  b.in("compressScale", 0.0,
       {.unit = Unit::kLength, .doc = "along the normal, where the edges have lost all of their length"});
  b.in("stretchScale", 0.0,
       {.unit = Unit::kLength, .doc = "along the normal, where the edges are twice as long"});
  b.out("stretch", Type::kWeights, "how much longer the edges are: 1 is twice as long").per_geometry();
  b.compute<ComputeStretch>()
      .bind(BindStrain<true>)
      .demand([](Demand& demand) { DemandRing(demand, "stretch", false); })
      .cost(300, 30);
  b.out("compress", Type::kWeights, "how much shorter they are: 1 is no length left").per_geometry();
  b.compute<ComputeCompress>()
      .bind(BindStrain<false>)
      .demand([](Demand& demand) { DemandRing(demand, "compress", false); })
      .cost(300, 30);
}

}  // namespace

KPSA_NODES(tension, registry) {
  AddDeformer<ComputePush>(
      registry, {.name = "tension",
                 .doc = "Measures how the edges around each point are stretched since the rest pose, "
                        "and pushes points along their normals by it.",
                 .own = DeclareTension,
                 .bind = BindPush,
                 .demand = [](Demand& demand) { DemandRing(demand, "outPoints", true); }})
      .cost(500, 60);
}

}  // namespace kpsa::engine
