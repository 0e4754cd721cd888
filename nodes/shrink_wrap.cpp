// shrinkWrap: points go onto another mesh, which may move (Maya's node of this name).
#include "nodes/kernels/shrink_wrap.h"

#include "graph/geometry.h"
#include "nodes/driver_mesh.h"
#include "nodes/mesh_topology.h"
#include "nodes/node_file.h"

namespace kpsa::engine {
namespace {

using ShrinkWrapContext = DeformerContext<In<"driverPoints", ConstPointsView>, In<"offset", double>>;

ShrinkWrapSettings Settings(const Structural& s) {
  ShrinkWrapSettings settings;
  settings.projection = s.choice<ShrinkWrapSettings::Projection>("projection");
  settings.side = s.choice<ShrinkWrapSettings::Side>("side");
  settings.reverse = s.get_bool("reverse");
  settings.bidirectional = s.get_bool("bidirectional");
  settings.closest_if_no_intersection = s.get_bool("closestIfNoIntersection");
  return settings;
}

// The faces of the points themselves, for their normals; null where they have none of that number.
const Topology* OwnTopology(const Structural& s, const PointSet& out, Status* error) {
  const Topology* own = TopologyOf(s.asset<Mesh>("mesh"), error);
  if (own != nullptr && own->point_count() != out.total()) {
    *error = Status::Invalid("its mesh has {} points, the geometry {}", own->point_count(), out.total());
    return nullptr;
  }
  return own;
}

void DemandShrinkWrap(Demand& demand) {
  const Structural& s = demand.structural();
  const PointSet& out = demand.output("outPoints");
  demand.Require("driverPoints", -1, PointSet::All(demand.input_total("driverPoints", -1)));
  const ShrinkWrapSettings settings = Settings(s);
  Status error;
  const bool normals = settings.projection == ShrinkWrapSettings::Projection::kNormals;
  const Topology* own = normals && !out.is_all() ? OwnTopology(s, out, &error) : nullptr;
  demand.Require(
      "inPoints", 0,
      own == nullptr
          ? out
          : PointSet::Of(ShrinkWrapDemand(settings, *own, out.ToVector(), WeightsAt(s, out)), out.total()));
}

struct ShrinkWrapBound {
  ShrinkWrapKernel kernel;
  CarriedFrame frame;
  double scale;  // stage lengths of a world length 1
  Double3 axis;  // at rest, unit length, in the stage
};

Result<BoundKernel> BindShrinkWrap(const Binding& binding) {
  const Structural& s = binding.structural();
  const PointSet &out = binding.output("outPoints"), &in = binding.input("inPoints");
  const ShrinkWrapSettings settings = Settings(s);
  const Result<CarriedFrame> frame = CarriedFrame::Bind(s);
  if (!frame.ok()) return frame.status();
  const Double3 axis = TransformVector(frame->stage_from_world(), s.value("axis").get<Double3>());
  if (!(Length(axis) > 0)) return Status::Invalid("axis: expected a direction, not of length 0");
  const Result<Driver> driver = BindDriver(s, DriverTree::kMoving);
  if (!driver.ok()) return driver.status();
  static const Topology kNone;
  const Topology* own = &kNone;
  if (settings.projection == ShrinkWrapSettings::Projection::kNormals) {
    Status error;
    own = OwnTopology(s, out, &error);
    if (own == nullptr) return error;
  }
  ShrinkWrapBound bound{
      ShrinkWrapKernel(settings, *driver->topology, *driver->rest->moving, driver->stage_from_driver, *own,
                       out.ToVector(), in.ToVector(), BoundWeights(binding)),
      *frame, 1 / frame->WorldScale(), axis * (1 / Length(axis))};
  const std::size_t scratch = bound.kernel.ScratchFloats();
  return MakeBound(std::move(bound), scratch);
}

void ComputeShrinkWrap(ShrinkWrapContext c) {
  const auto& bound = c.kernel_as<ShrinkWrapBound>();
  const Parallel parallel = HostParallel(c);
  const Matrix4 motion = bound.frame.Motion(c.get<"parentMatrix">());
  // An axis that nothing turns keeps its bits
  const Double3 axis = motion == Matrix4() ? bound.axis : UnitOrZero(TransformVector(motion, bound.axis));
  bound.kernel.Run({c.get<"envelope">(), c.get<"offset">() * bound.scale, c.get<"driverPoints">(), axis},
                   c.get<"inPoints">(), c.out<"outPoints">(), {c.scratch(), bound.kernel.ScratchFloats()},
                   &parallel);
}

void DeclareShrinkWrap(NodeBuilder& b) {
  using Projection = ShrinkWrapSettings::Projection;
  using Side = ShrinkWrapSettings::Side;
  AddDriver(b);
  b.in("offset", 0.0,
       {.unit = Unit::kLength,
        .doc = "distance from the surface, positive outside (where its normals point)"});
  b.enumeration<Projection>(
      "projection",
      {{"closest", Projection::kClosest},
       {"vertexNormals", Projection::kNormals},
       {"parallelToAxis", Projection::kAxis}},
      true,
      "to the nearest place of the surface, or where the line along the point's normal or along "
      "`axis` meets it");
  b.structural("axis", Double3{0, 1, 0},
               {.doc = "direction of parallelToAxis, world axes at rest; it turns with parentMatrix"});
  b.structural("reverse", false, {.doc = "lines go against the normal or axis"});
  b.structural("bidirectional", false, {.doc = "lines go both ways; the nearer hit counts"});
  b.structural("closestIfNoIntersection", false,
               {.doc = "a point whose line meets nothing goes to the nearest place; otherwise it stays"});
  b.enumeration<Side>(
      "side", {{"surface", Side::kSurface}, {"outside", Side::kOutside}, {"inside", Side::kInside}}, true,
      "surface: all points go onto it; outside: only those inside, so that all end up outside; "
      "inside: the other way round");
}

}  // namespace

KPSA_NODES(shrink_wrap, registry) {
  AddDeformer<ComputeShrinkWrap>(registry, {.name = "shrinkWrap",
                                            .doc = "Points go onto the surface of another mesh.",
                                            .own = DeclareShrinkWrap,
                                            .bind = BindShrinkWrap,
                                            .demand = DemandShrinkWrap})
      .version(2)  // an axis that its parent turns
      .cost(2000, 900);
}

}  // namespace kpsa::engine
