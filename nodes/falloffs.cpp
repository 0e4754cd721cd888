// Falloffs that may vary: weights of points by where they are now, for the `falloffWeights` of deformers
// (Maya: primitiveFalloff, proximityFalloff, blendFalloff). Each serves several geometries: element i of
// inPoints, geometryMatrix and outputWeights.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>

#include "base/falloff_shapes.h"
#include "base/matrix.h"
#include "graph/geometry.h"
#include "nodes/driver_mesh.h"
#include "nodes/node_file.h"

namespace kpsa::engine {
namespace {

template <typename... Own>
using FalloffContext = NodeContext<In<"inPoints", ConstPointsView>, In<"parentMatrix", Matrix4>, Own...,
                                   Out<"outputWeights", PointsView>>;
using SphereContext = FalloffContext<In<"matrix", Matrix4>, In<"radius", double>, In<"fullRadius", double>>;
using CapsuleContext = FalloffContext<In<"startMatrix", Matrix4>, In<"endMatrix", Matrix4>,
                                      In<"radius", double>, In<"fullRadius", double>>;
using PlaneContext = FalloffContext<In<"matrix", Matrix4>, In<"start", double>, In<"end", double>>;
using ProximityContext =
    FalloffContext<In<"driverPoints", ConstPointsView>, In<"radius", double>, In<"fullRadius", double>>;

constexpr std::size_t kFalloffGrain = 2048;

// Where the points are: world from their space, which is the world after the skin. Before it, parentMatrix
// carries them from where they rest.
struct FalloffPlace {
  FalloffFade fade = FalloffFade::kSmooth;
  bool moved = false;
  Matrix4 world_from_points_at_rest, parent_rest_inverse;

  // carries: parentMatrix moves something else, too.
  static Result<FalloffPlace> Bind(const Structural& s, bool carries = false) {
    FalloffPlace place;
    place.fade = s.choice<FalloffFade>("curve");
    place.moved = s.is_set("geometryMatrix", s.geometry());
    if (!place.moved && !carries) return place;
    if (place.moved) place.world_from_points_at_rest = s.value("geometryMatrix").get<Matrix4>();
    const Result<Matrix4> parent = RestMatrix(s, "parentMatrix");
    if (!parent.ok()) return parent.status();
    if (!Invert(*parent, &place.parent_rest_inverse))
      return Status::Invalid("parentMatrix is singular at rest");
    return place;
  }
  Matrix4 Carried(const Matrix4& world_at_rest, const Matrix4& parent) const {
    return parent * parent_rest_inverse * world_at_rest;
  }
  Matrix4 WorldFromPoints(const Matrix4& parent) const {
    return moved ? Carried(world_from_points_at_rest, parent) : Matrix4();
  }
};

Result<BoundKernel> BindShape(const Binding& binding) {
  Result<FalloffPlace> place = FalloffPlace::Bind(binding.structural());
  if (!place.ok()) return place.status();
  return MakeBound(std::move(*place), 0);
}

// weights[i] = weight(m * points[i])
template <typename... Own, typename F>
void ForPoints(NodeContext<Own...> c, const Matrix4& m, F weight) {
  const ConstPointsView& in = c.template get<"inPoints">();
  float* out = c.template out<"outputWeights">().x;
  c.For(in.count, kFalloffGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      out[i] = static_cast<float>(weight(TransformPoint(m, {in.x[i], in.y[i], in.z[i]})));
  });
}

// A step at the radius where `full` is no less; a radius of nothing holds its middle only.
double ByDistance(double distance, double full, double radius, FalloffFade fade) {
  full = std::max(0.0, full);
  if (radius > full) return DistanceFalloff(distance - full, radius - full, fade);
  return distance > std::max(0.0, radius) ? 0 : 1;
}

void ComputeSphere(SphereContext c) {
  const auto& place = c.kernel_as<FalloffPlace>();
  const double radius = c.get<"radius">(), full = c.get<"fullRadius">();
  Matrix4 from_world;
  const bool there = Invert(c.get<"matrix">(), &from_world);
  ForPoints(c, from_world * place.WorldFromPoints(c.get<"parentMatrix">()),
            [&](Double3 p) { return there ? ByDistance(Length(p), full, radius, place.fade) : 0; });
}

void ComputeCapsule(CapsuleContext c) {
  const auto& place = c.kernel_as<FalloffPlace>();
  const Double3 a = TransformPoint(c.get<"startMatrix">(), {}), b = TransformPoint(c.get<"endMatrix">(), {});
  const double radius = c.get<"radius">(), full = c.get<"fullRadius">();
  ForPoints(c, place.WorldFromPoints(c.get<"parentMatrix">()),
            [&](Double3 p) { return ByDistance(SegmentDistance(p, a, b), full, radius, place.fade); });
}

void ComputePlane(PlaneContext c) {
  const auto& place = c.kernel_as<FalloffPlace>();
  const double start = c.get<"start">(), end = c.get<"end">();
  Matrix4 from_world;
  const bool there = Invert(c.get<"matrix">(), &from_world);
  ForPoints(c, from_world * place.WorldFromPoints(c.get<"parentMatrix">()), [&](Double3 p) {
    if (!there) return 0.0;
    if (start == end) return p.y <= start ? 1.0 : 0.0;  // a step
    return PlaneFalloff(p, {}, {0, 1, 0}, start, end, place.fade);
  });
}

// The driver's surface: in the world, or in mesh space, from where parentMatrix carries it as it does the
// points.
struct Proximity {
  FalloffPlace place;
  bool carried = false;
  Matrix4 world_from_driver;  // at rest
  std::optional<MovingSurface> surface;
  std::size_t row = 0;  // floats of a component of the carried driver
};

Result<BoundKernel> BindProximity(const Binding& binding) {
  const Structural& s = binding.structural();
  Proximity bound;
  bound.carried = s.is_set("driverMatrix");
  const Result<FalloffPlace> place = FalloffPlace::Bind(s, bound.carried);
  if (!place.ok()) return place.status();
  bound.place = *place;
  const Result<Driver> driver = BindDriver(s, DriverTree::kMoving, s.value("driverMatrix").get<Matrix4>());
  if (!driver.ok()) return driver.status();
  bound.world_from_driver = driver->stage_from_driver;
  bound.surface = driver->rest->moving;
  if (bound.carried) bound.row = PaddedCount(driver->topology->point_count());
  const std::size_t scratch = 3 * bound.row;
  return MakeBound(std::move(bound), scratch);
}

void ComputeProximity(ProximityContext c) {
  const auto& bound = c.kernel_as<Proximity>();
  const Matrix4& parent = c.get<"parentMatrix">();
  const double radius = c.get<"radius">(), full = c.get<"fullRadius">();
  ConstPointsView surface = c.get<"driverPoints">();
  if (bound.carried) {
    const ConstPointsView driver = surface;
    const Matrix4 world_from_driver = bound.place.Carried(bound.world_from_driver, parent);
    const PointsView carried{c.scratch(), c.scratch() + bound.row, c.scratch() + 2 * bound.row, driver.count};
    c.For(driver.count, kFalloffGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const Double3 p = TransformPoint(world_from_driver, {driver.x[i], driver.y[i], driver.z[i]});
        carried.x[i] = static_cast<float>(p.x);
        carried.y[i] = static_cast<float>(p.y);
        carried.z[i] = static_cast<float>(p.z);
      }
    });
    surface = carried;
  }
  const MovingSurface::Lease tree = bound.surface->At(surface);
  ForPoints(c, bound.place.WorldFromPoints(parent), [&](Double3 p) {
    const SurfacePoint near = tree->Closest(p, std::max(radius, 0.0));
    return near.triangle == kNoIndex ? 0
                                     : ByDistance(std::sqrt(near.squared), full, radius, bound.place.fade);
  });
}

// All of the driver, for any point.
void DemandProximity(Demand& demand) {
  demand.Require("inPoints", 0, demand.output("outputWeights"));
  demand.Require("driverPoints", -1, PointSet::All(demand.input_total("driverPoints", -1)));
}

struct Painted {
  std::vector<float> weights;  // at the output points
};

Result<BoundKernel> BindWeightMap(const Binding& binding) {
  const auto* map = binding.structural().asset<WeightMap>("weights");
  if (map == nullptr) return Status::Invalid("weights are not set");
  const PointSet& out = binding.output("outputWeights");
  Painted painted;
  for (Index i = 0; i < out.size(); ++i) painted.weights.push_back(map->weights()[out[i]]);
  return MakeBound(std::move(painted), 0);
}

void ComputeWeightMap(NodeContext<In<"multiplier", double>, Out<"outputWeights", PointsView>> c) {
  const double scale = c.get<"multiplier">();
  const std::vector<float>& weights = c.kernel_as<Painted>().weights;
  float* out = c.out<"outputWeights">().x;
  for (std::size_t i = 0; i < weights.size(); ++i)
    out[i] = static_cast<float>(std::clamp(weights[i] * scale, 0.0, 1.0));
}

enum class FalloffOperation { kMultiply, kMax, kMin, kAdd, kSubtract, kAverage };

double Combined(FalloffOperation how, double a, double b) {
  switch (how) {
    case FalloffOperation::kMultiply:
      return a * b;
    case FalloffOperation::kMax:
      return std::max(a, b);
    case FalloffOperation::kMin:
      return std::min(a, b);
    case FalloffOperation::kAdd:
      return std::min(a + b, 1.0);
    case FalloffOperation::kSubtract:
      return std::max(a - b, 0.0);
    case FalloffOperation::kAverage:
      break;
  }
  return (a + b) / 2;
}

using CombineContext = NodeContext<In<"input1", ConstPointsView>, In<"input2", ConstPointsView>,
                                   In<"operation", FalloffOperation>, Out<"outputWeights", PointsView>>;

void ComputeCombine(CombineContext c) {
  const ConstPointsView &a = c.get<"input1">(), &b = c.get<"input2">();
  const FalloffOperation how = c.get<"operation">();
  float* out = c.out<"outputWeights">().x;
  c.For(a.count, kFalloffGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) out[i] = static_cast<float>(Combined(how, a.x[i], b.x[i]));
  });
}

NodeBuilder AddFalloff(NodeRegistry& registry, const char* name, const char* doc,
                       std::string_view carried = "points") {
  NodeBuilder b = registry.add(name, doc);
  b.category("falloff");
  b.points_in("inPoints", "the points, as they come to the deformer").per_geometry();
  b.in("parentMatrix", Matrix4(),
       {.doc = fmt::format("what carries {} from before a skin; `parent:` connects it", carried)})
      .world_place();
  b.structural("geometryMatrix", Matrix4(),
               {.doc = "world from the points' space at rest, where they are before the skin"})
      .per_geometry();
  b.enumeration<FalloffFade>("curve", {{"smooth", FalloffFade::kSmooth}, {"linear", FalloffFade::kLinear}},
                             true, "how the weight gets from 1 to 0");
  return b;
}

void AddRadius(NodeBuilder& b, const char* where) {
  b.in("radius", 1.0, {.min = 0, .unit = Unit::kLength, .doc = std::string("where it is 0; ") + where});
  b.in("fullRadius", 0.0,
       {.min = 0, .unit = Unit::kLength, .doc = "up to where it is 1; as large as the radius: a step"});
}

template <auto kCompute>
NodeBuilder& FinishFalloff(NodeBuilder& b, BindFn bind) {
  b.out("outputWeights", Type::kWeights, "0 to 1").per_geometry();
  return b.compute<kCompute>().bind(std::move(bind)).cost(200, 12);
}

}  // namespace

KPSA_NODES(falloffs, registry) {
  NodeBuilder sphere =
      AddFalloff(registry, "sphereFalloff", "1 in the middle of a sphere, 0 at its radius and beyond.");
  sphere.in("matrix", Matrix4(), {.doc = "the sphere's handle, whose scale makes it an ellipsoid"})
      .world_place();
  AddRadius(sphere, "in the handle's units");
  FinishFalloff<ComputeSphere>(sphere, BindShape);

  NodeBuilder capsule =
      AddFalloff(registry, "capsuleFalloff", "1 on a line between two places, 0 at the radius and beyond.");
  capsule.in("startMatrix", Matrix4(), {.doc = "world, where the line starts"}).world_place();
  capsule.in("endMatrix", Matrix4(), {.doc = "world, where it ends"}).world_place();
  AddRadius(capsule, "in the world");
  FinishFalloff<ComputeCapsule>(capsule, BindShape);

  NodeBuilder plane = AddFalloff(
      registry, "planeFalloff",
      "1 at the height `start` along the handle's y axis and on the side away from `end`, 0 from there on.");
  plane.in("matrix", Matrix4(), {.doc = "the plane's handle"}).world_place();
  plane.in("start", 0.0, {.unit = Unit::kLength, .doc = "in the handle's units; the same as `end`: a step"});
  plane.in("end", 1.0, {.unit = Unit::kLength, .doc = "in the handle's units"});
  FinishFalloff<ComputePlane>(plane, BindShape);

  NodeBuilder proximity = AddFalloff(registry, "proximityFalloff",
                                     "1 on the surface of a mesh, which may move; 0 at the radius from it.",
                                     "points and a driver");
  AddDriver(proximity);
  AddRadius(proximity, "in the world");
  proximity.version(2);  // carries its driver
  FinishFalloff<ComputeProximity>(proximity, BindProximity).demand(DemandProximity).cost(2000, 400);

  registry.add("weightMap", "A painted map as a falloff, with a factor that may vary.")
      .category("falloff")
      .structural("weights", Type::kAsset, {.doc = "the map; `weights:`, `members:` and `falloff:` set it"})
      .per_geometry()
      .in("multiplier", 1.0, {.doc = "of every weight, before they are cut to 0 to 1"})
      .out("outputWeights", Type::kWeights, "0 to 1")
      .per_geometry()
      .compute<ComputeWeightMap>()
      .bind(BindWeightMap)
      .point_count([](const Structural& s, std::string_view, int) -> Result<Index> {
        const auto* map = s.asset<WeightMap>("weights");
        if (map == nullptr) return Status::Invalid("weights are not set");
        return static_cast<Index>(map->weights().size());
      })
      .cost(100, 1);

  NodeBuilder combine = registry.add("combineFalloff", "One falloff of two.");
  combine.category("falloff");
  combine.points_in("input1", "weights; `falloffs:` connects both", Type::kWeights).per_geometry();
  combine.points_in("input2", "weights", Type::kWeights).per_geometry();
  combine.enumeration<FalloffOperation>(
      "operation",
      {{"multiply", FalloffOperation::kMultiply},
       {"max", FalloffOperation::kMax},
       {"min", FalloffOperation::kMin},
       {"add", FalloffOperation::kAdd},
       {"subtract", FalloffOperation::kSubtract},
       {"average", FalloffOperation::kAverage}},
      false, "add: their sum, up to 1; subtract: the first less the second, down to 0");
  combine.out("outputWeights", Type::kWeights, "0 to 1").per_geometry();
  combine.compute<ComputeCombine>().cost(100, 2);
}

}  // namespace kpsa::engine
