// wrap and proximityWrap: points follow the surface of another mesh (Maya's nodes of these names).
#include "nodes/kernels/wrap.h"

#include <limits>

#include "graph/geometry.h"
#include "nodes/driver_mesh.h"
#include "nodes/node_file.h"

namespace kpsa::engine {
namespace {

// A search along the surface, or among points (wrap).
template <bool kAmongPoints>
Result<Driver> BindDriverOf(const Structural& s) {
  return BindDriver(s, kAmongPoints ? DriverTree::kPoints : DriverTree::kTriangles);
}

template <bool kAmongPoints>
WrapMode ModeOf(const Structural& s) {
  if constexpr (kAmongPoints) {
    return WrapMode::kOffset;
  } else {
    return s.choice<WrapMode>("wrapMode");
  }
}

template <bool kAmongPoints>
WrapInfluences FindInfluences(const Structural& s, const Driver& driver, const PointSet& out,
                              ConstPointsView rest, std::span<const float> weights) {
  const TriangleTree& surface = driver.rest->tree;
  // Distances are world ones: a stage in mesh space may be scaled
  const Result<CarriedFrame> frame = CarriedFrame::Bind(s);
  const double scale = frame.ok() ? frame->WorldScale() : 1;
  const double asked = s.get_double("maxDistance") / scale;
  const double distance = asked > 0 ? asked : std::numeric_limits<double>::infinity();
  if constexpr (kAmongPoints) {
    return NearestInfluences(surface, rest, out.ToVector(), distance,
                             static_cast<std::size_t>(s.get_int("influences")), weights);
  } else {
    return SurfaceInfluences(surface, *driver.topology, rest, out.ToVector(), distance,
                             s.get_int("smoothInfluences"), weights);
  }
}

template <bool kAmongPoints>
void DemandWrapNode(Demand& demand) {
  const Structural& s = demand.structural();
  const PointSet& out = demand.output("outPoints");
  demand.Require("inPoints", 0, out);
  const Result<Driver> driver = BindDriverOf<kAmongPoints>(s);
  const Result<ConstPointsView> rest = RestPoints(s);
  const Index total = demand.input_total("driverPoints", -1);
  if (!driver.ok() || !rest.ok() || driver->topology->point_count() != total) {
    demand.Require("driverPoints", -1, PointSet::All(total));  // bind reports what is wrong
    return;
  }
  const WrapInfluences influences = FindInfluences<kAmongPoints>(s, *driver, out, *rest, WeightsAt(s, out));
  demand.Require(
      "driverPoints", -1,
      PointSet::Of(WrapDemand(*driver->topology, driver->rest->points, influences, ModeOf<kAmongPoints>(s)),
                   total));
}

template <bool kAmongPoints>
Result<BoundKernel> BindWrap(const Binding& binding) {
  const Structural& s = binding.structural();
  const PointSet& out = binding.output("outPoints");
  const Result<Driver> driver = BindDriverOf<kAmongPoints>(s);
  if (!driver.ok()) return driver.status();
  const Result<ConstPointsView> rest = RestPoints(s);
  if (!rest.ok()) return rest.status();
  const std::vector<float> weights = BoundWeights(binding);
  const WrapInfluences influences = FindInfluences<kAmongPoints>(s, *driver, out, *rest, weights);
  WrapKernel kernel(ModeOf<kAmongPoints>(s), *driver->topology, driver->rest->points,
                    driver->stage_from_driver, influences, *rest, out.ToVector(),
                    binding.input("driverPoints", -1).ToVector(), weights);
  const std::size_t scratch = kernel.ScratchFloats();
  return MakeBound(std::move(kernel), scratch);
}

void ComputeWrap(DeformerContext<In<"driverPoints", ConstPointsView>> c) {
  const auto& kernel = c.kernel_as<WrapKernel>();
  const Parallel parallel = HostParallel(c);
  kernel.Run({c.get<"envelope">(), c.get<"driverPoints">()}, c.get<"inPoints">(), c.out<"outPoints">(),
             {c.scratch(), kernel.ScratchFloats()}, &parallel);
}

void DeclareWrap(NodeBuilder& b) {
  AddDriver(b);
  b.structural("maxDistance", 0.0,
               {.min = 0,
                .unit = Unit::kLength,
                .doc = "driver points farther away have no influence, and points without one stay; "
                       "0: no limit"});
  b.structural("influences", 8,
               {.min = 1, .max = 64, .doc = "how many driver points, the nearest ones, move a point"});
  b.enumeration("falloffMode", {"volume"}, true, "how distances are measured: straight through space");
}

void DeclareProximityWrap(NodeBuilder& b) {
  AddDriver(b);
  b.enumeration<WrapMode>(
      "wrapMode", {{"offset", WrapMode::kOffset}, {"surface", WrapMode::kSurface}, {"snap", WrapMode::kSnap}},
      true,
      "offset: the offset from the surface turns with it; surface: it is stretched with it, "
      "too; snap: points lie on the surface");
  b.structural("maxDistance", 0.0,
               {.min = 0,
                .unit = Unit::kLength,
                .doc = "points farther from the driver stay where they are; 0: no limit"});
  b.structural(
      "smoothInfluences", 0,
      {.min = 0, .max = 20, .doc = "rings over which the influence of the nearest triangle is spread"});
}

}  // namespace

KPSA_NODES(wrap, registry) {
  AddDeformer<ComputeWrap>(registry,
                           {.name = "wrap",
                            .doc = "Points follow the nearest points of a driver mesh, each with its frame.",
                            .own = DeclareWrap,
                            .bind = BindWrap<true>,
                            .demand = DemandWrapNode<true>})
      .version(2)  // floats
      .cost(3000, 60);
  AddDeformer<ComputeWrap>(registry, {.name = "proximityWrap",
                                      .doc = "Points follow the nearest place of a driver's surface.",
                                      .own = DeclareProximityWrap,
                                      .bind = BindWrap<false>,
                                      .demand = DemandWrapNode<false>})
      .version(2)  // floats
      .cost(5000, 46);
}

}  // namespace kpsa::engine
