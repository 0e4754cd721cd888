// wrap and proximityWrap: points follow the surface of another mesh (Maya's nodes of these names).
#include "nodes/kernels/wrap.h"

#include <limits>

#include "base/digest.h"
#include "graph/geometry.h"
#include "nodes/driver_mesh.h"
#include "nodes/kernels/carried_delta.h"
#include "nodes/node_file.h"

namespace kpsa::engine {
namespace {

// What it costs (bench_steps, kpsa profile): a run, a point that comes out, an influence of one, a driver point.
constexpr float kWrapNs = 250, kWrapPointNs = 2.5f, kInfluenceNs = 0.46f, kDriverNs = 5;

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

// Those that have a weight.
std::vector<Index> WithWeight(const std::vector<Index>& points, std::span<const float> weights) {
  if (weights.empty()) return points;
  std::vector<Index> moved;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (weights[i] != 0) moved.push_back(points[i]);
  }
  return moved;
}
// Of all points, from those of the ones that have a weight.
WrapInfluences OfAll(WrapInfluences of_moved, std::span<const float> weights) {
  std::vector<Index> offsets = {0};
  std::size_t moved = 0;
  for (const float weight : weights) {
    moved += weight != 0 ? 1 : 0;
    offsets.push_back(of_moved.offsets[moved]);
  }
  of_moved.offsets = std::move(offsets);
  return of_moved;
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
  const auto rings = static_cast<int>(s.get_int(kAmongPoints ? "influences" : "smoothInfluences"));
  Hasher hasher;
  hasher.Add(kAmongPoints);
  hasher.Add(distance);
  hasher.Add(rings);
  for (const float* row : {rest.x, rest.y, rest.z}) hasher.AddLong(std::span<const float>(row, rest.count));
  const auto find = [&](std::span<const Index> points) {
    if constexpr (kAmongPoints) {
      return NearestInfluences(surface, rest, points, distance, static_cast<std::size_t>(rings));
    } else {
      return SurfaceInfluences(surface, *driver.topology, rest, points, distance, rings);
    }
  };
  const std::vector<Index> points = out.ToVector();
  WrapInfluences influences =
      driver.rest->influences->Of(hasher.Finish(), rest.count, WithWeight(points, weights), find);
  return weights.empty() ? influences : OfAll(std::move(influences), weights);
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

struct WrapBound {
  WrapKernel kernel;
  bool carried = false;  // by the parent: in world space
  ParentRest parent;
  std::size_t KernelFloats() const { return (kernel.ScratchFloats() + 15) / 16 * 16; }
};

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
  const Result<CarriedFrame> frame = CarriedFrame::Bind(s);
  if (!frame.ok()) return frame.status();
  const PointSet& driver_points = binding.input("driverPoints", -1);
  Double3 middle;  // of the driver
  for (const Double3& p : driver->rest->points)
    middle = middle + p * (1 / static_cast<double>(driver->rest->points.size()));
  WrapBound bound{
      WrapKernel(ModeOf<kAmongPoints>(s), *driver->topology, driver->rest->points, driver->stage_from_driver,
                 influences, *rest, out.ToVector(), driver_points.ToVector(), weights),
      !frame->fixed(),
      {frame->parent_rest(), frame->parent_rest_inverse(),
       TransformPoint(frame->parent_rest_inverse(), middle)}};
  std::size_t scratch = bound.KernelFloats();
  if (bound.carried) scratch += 3 * PaddedCount(driver_points.size()) + 6 * PaddedCount(out.size());
  const WrapKernel& kernel = bound.kernel;
  const float ns = kWrapNs + kWrapPointNs * static_cast<float>(kernel.point_count()) +
                   kInfluenceNs * static_cast<float>(kernel.influence_count()) +
                   kDriverNs * static_cast<float>(kernel.driver_count());
  BoundKernel made = MakeBound(std::move(bound), scratch);
  made.cost_ns = ns;
  return made;
}

// x y z rows of `count` points from there on; what follows them.
PointsView TakeRows(std::size_t count, float** scratch) {
  const std::size_t row = PaddedCount(count);
  const PointsView view{*scratch, *scratch + row, *scratch + 2 * row, count};
  *scratch += 3 * row;
  return view;
}

void ComputeWrap(DeformerContext<In<"driverPoints", ConstPointsView>> c) {
  const auto& bound = c.kernel_as<WrapBound>();
  const Parallel parallel = HostParallel(c);
  const std::span<float> kernel_scratch(c.scratch(), bound.kernel.ScratchFloats());
  const double envelope = c.get<"envelope">();
  const ConstPointsView &driver = c.get<"driverPoints">(), &in = c.get<"inPoints">();
  const PointsView& out = c.out<"outPoints">();
  const Matrix4& parent = c.get<"parentMatrix">();
  ParentMotion motion;
  if (!bound.carried || parent == bound.parent.parent || !FindParentMotion(parent, bound.parent, &motion)) {
    bound.kernel.Run({envelope, driver}, in, out, kernel_scratch, &parallel);
    return;
  }
  // What the driver does to the points where the parent rests, then carried with it
  float* scratch = c.scratch() + bound.KernelFloats();
  const PointsView resting_driver = TakeRows(driver.count, &scratch), resting = TakeRows(in.count, &scratch),
                   wrapped = TakeRows(in.count, &scratch);
  const auto to_rest = [&](const ConstPointsView& from, const PointsView& to) {
    c.For(from.count, 4096, [&](std::size_t begin, std::size_t end) {
      ApplyAffineDelta(motion.to_rest, nullptr, 1, from, to, begin, end);
    });
  };
  to_rest(driver, resting_driver);
  to_rest(in, resting);
  bound.kernel.Run({envelope, resting_driver}, resting, wrapped, kernel_scratch, &parallel);
  c.For(in.count, 4096, [&](std::size_t begin, std::size_t end) {
    AddTurned(motion.linear, resting, wrapped, in, out, begin, end);
  });
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
  AddDeformer<ComputeWrap>(
      registry, {.name = "wrap",
                 .doc = "Points follow the nearest points of a driver mesh, each with its frame. How "
                        "parentMatrix has moved "
                        "since the rest pose is no move of the driver: it carries the points already.",
                 .own = DeclareWrap,
                 .bind = BindWrap<true>,
                 .demand = DemandWrapNode<true>})
      .version(3)  // carried by its parent
      .cost(kWrapNs, kWrapPointNs + 8 * kInfluenceNs);
  AddDeformer<ComputeWrap>(
      registry, {.name = "proximityWrap",
                 .doc = "Points follow the nearest place of a driver's surface. How parentMatrix has "
                        "moved since the rest pose is no move of the driver: it carries the points already.",
                 .own = DeclareProximityWrap,
                 .bind = BindWrap<false>,
                 .demand = DemandWrapNode<false>})
      .version(3)  // carried by its parent
      .cost(kWrapNs, kWrapPointNs + 3 * kInfluenceNs);
}

}  // namespace kpsa::engine
