// uvPin and follicle: frames that ride on a mesh (Maya's nodes of these names).
#include <cmath>

#include "base/matrix.h"
#include "graph/geometry.h"
#include "nodes/driver_mesh.h"
#include "nodes/kernels/surface_pin.h"
#include "nodes/node_file.h"

namespace kpsa::engine {
namespace {

using PinPoints = NodeContext<In<"driverPoints", ConstPointsView>>;
using UvPinContext = NodeContext<In<"driverPoints", ConstPointsView>, In<"relativeSpaceMatrix", Matrix4>,
                                 Out<"outputMatrix", Matrix4>>;
using FollicleContext =
    NodeContext<In<"driverPoints", ConstPointsView>, Out<"outTranslate", Double3>, Out<"outRotate", Double3>,
                Out<"outMatrix", Matrix4>, Out<"outNormal", Double3>, Out<"outTangent", Double3>>;
enum class RelativeSpace { kWorld, kLocal, kCustom };

// The attributes that say where a pin is; element -1 of those that are no arrays.
struct PinPlace {
  const char *u, *v;
  int element;
};

struct PinBound {
  Index entries[3] = {0, 0, 0};  // of the points demanded
  Index corners[3] = {0, 0, 0};  // of the mesh
  double weights[3] = {0, 0, 0};
  UvDirection direction;
  PinAxes axes;
  RelativeSpace space = RelativeSpace::kWorld;
  Matrix4 world_from_driver;
};

Result<TrianglePlace> PlaceByFace(const Structural& s, const PinPlace& at, std::size_t count) {
  const std::int64_t face = s.value("face", at.element).AsInt();
  if (face >= static_cast<std::int64_t>(count))
    return Status::Invalid("face: {}, its driver has the triangles 0 to {}", face, count - 1);
  const Double3 share = s.value("barycentric", at.element).get<Double3>();
  const double sum = share.x + share.y + share.z;
  if (!std::isfinite(sum) || !(std::fabs(sum) > 1e-9))
    return Status::Invalid("barycentric: {}, {}, {}, expected numbers whose sum is not 0", share.x, share.y,
                           share.z);
  return TrianglePlace{static_cast<Index>(face), {share.x / sum, share.y / sum, share.z / sum}};
}

Result<TrianglePlace> PlaceByUv(const Structural& s, const PinPlace& at, std::size_t count) {
  for (const char* name : {at.u, at.v}) {
    if (at.element >= 0 && !s.is_set(name, at.element))
      return Status::Invalid("pin {} has no place: set {}[{}], or face[{}]", at.element, name, at.element,
                             at.element);
  }
  const double u = s.value(at.u, at.element).AsDouble(), v = s.value(at.v, at.element).AsDouble();
  if (!std::isfinite(u) || !std::isfinite(v))
    return Status::Invalid("{}, {}: {}, {}, expected finite numbers", at.u, at.v, u, v);
  const auto* uvs = s.asset<TriangleUvs>("driverUvs");
  if (uvs == nullptr)
    return Status::Invalid("its driver has no texture coordinates: place the pin by `face`");
  if (uvs->values().size() != 6 * count)
    return Status::Invalid("driverUvs are of {} triangles, its driver has {}", uvs->values().size() / 6,
                           count);
  const TrianglePlace place = uvs->Derived<UvMap>([uvs] { return UvMap(uvs->values()); }).Find(u, v);
  if (place.triangle == kNoIndex)
    return Status::Invalid("none of its driver's faces has texture coordinates");
  return place;
}

// Everything but the entries.
Result<PinBound> MakePin(const Structural& s, const PinPlace& at, Index points) {
  const Result<const Mesh*> mesh = DriverMesh(s, points);
  if (!mesh.ok()) return mesh.status();
  const std::vector<Index>& triangles = (*mesh)->data().triangles;
  const std::size_t count = triangles.size() / 3;
  const Result<TrianglePlace> place =
      s.value("face", at.element).AsInt() >= 0 ? PlaceByFace(s, at, count) : PlaceByUv(s, at, count);
  if (!place.ok()) return place.status();
  PinBound pin;
  std::copy_n(place->weights, 3, pin.weights);
  for (std::size_t k = 0; k < 3; ++k) {
    pin.corners[k] = triangles[3 * std::size_t{place->triangle} + k];
    if (pin.corners[k] >= points)
      return Status::Invalid("triangle {} of its driver has the corner {} of {} points", place->triangle,
                             pin.corners[k], points);
  }
  if (const auto* uvs = s.asset<TriangleUvs>("driverUvs");
      uvs != nullptr && uvs->values().size() == 6 * count) {
    pin.direction = DirectionOfU(std::span(uvs->values()).subspan(6 * std::size_t{place->triangle}, 6));
  }
  pin.world_from_driver = s.value("driverMatrix").get<Matrix4>();
  return pin;
}

Result<PinBound> MakeUvPin(const Structural& s, Index points) {
  Result<PinBound> pin = MakePin(s, {"coordinateU", "coordinateV", s.geometry()}, points);
  if (!pin.ok()) return pin.status();
  pin->axes = {s.choice<PinAxis>("normalAxis"), s.choice<PinAxis>("tangentAxis")};
  pin->space = s.choice<RelativeSpace>("relativeSpaceMode");
  if (!pin->axes.Differ())
    return Status::Invalid("normalAxis and tangentAxis are the same axis, expected two of x, y and z");
  return pin;
}

Result<PinBound> MakeFollicle(const Structural& s, Index points) {
  Result<PinBound> pin = MakePin(s, {"parameterU", "parameterV", -1}, points);
  if (pin.ok()) pin->axes = {PinAxis::kZ, PinAxis::kX};
  return pin;
}

using MakeFn = Result<PinBound> (*)(const Structural&, Index);

template <MakeFn kMake>
void DemandPin(Demand& demand) {
  const Index total = demand.input_total("driverPoints", -1);
  const Result<PinBound> pin = kMake(demand.structural(), total);
  demand.Require("driverPoints", -1,
                 pin.ok() ? PointSet::Of({pin->corners, pin->corners + 3}, total)
                          : PointSet::All(total));  // bind reports what is wrong
}

template <MakeFn kMake>
Result<BoundKernel> BindPin(const Binding& binding) {
  const PointSet& in = binding.input("driverPoints", -1);
  Result<PinBound> pin = kMake(binding.structural(), in.total());
  if (!pin.ok()) return pin.status();
  for (int k = 0; k < 3; ++k)
    pin->entries[k] = in.PositionsOf(PointSet::Of({pin->corners[k]}, in.total()))[0];
  return MakeBound(std::move(*pin), 0);
}

SurfaceFrame FrameNow(PinPoints c, bool in_world) {
  const auto& pin = c.kernel_as<PinBound>();
  const ConstPointsView& points = c.get<"driverPoints">();
  Double3 corners[3];
  for (int k = 0; k < 3; ++k) {
    const Index i = pin.entries[k];
    corners[k] = {points.x[i], points.y[i], points.z[i]};
    if (in_world) corners[k] = TransformPoint(pin.world_from_driver, corners[k]);
  }
  return FrameOnTriangle(corners, pin.weights, pin.direction);
}

void ComputeUvPin(UvPinContext c) {
  const auto& pin = c.kernel_as<PinBound>();
  const Matrix4 frame = PinMatrix(FrameNow(c, pin.space != RelativeSpace::kLocal), pin.axes);
  c.out<"outputMatrix">() =
      pin.space == RelativeSpace::kCustom ? InverseOrIdentity(c.get<"relativeSpaceMatrix">()) * frame : frame;
}

void ComputeFollicle(FollicleContext c) {
  const SurfaceFrame frame = FrameNow(c, true);
  const Matrix4 matrix = PinMatrix(frame, c.kernel_as<PinBound>().axes);
  c.out<"outTranslate">() = frame.origin;
  c.out<"outRotate">() = EulerFromRotation(matrix, RotateOrder::kXyz);
  c.out<"outMatrix">() = matrix;
  c.out<"outNormal">() = frame.normal;
  c.out<"outTangent">() = frame.tangent;
}

void AddSurface(NodeBuilder& b) {
  b.category("constraint");
  AddDriver(b);
  b.structural("driverUvs", Type::kAsset,
               {.doc = "its texture coordinates, as the file has them (of glTF: v grows downwards)"});
}

}  // namespace

KPSA_NODES(uv_pin, registry) {
  constexpr double kThird = 1.0 / 3;
  NodeBuilder pin = registry.add(
      "uvPin",
      "Frames that ride on a mesh, each at a uv coordinate (or in a triangle): at the place of the surface, "
      "along its normal and the direction of growing u. Of triangles whose coordinates overlap the first "
      "counts; a coordinate outside of all is the nearest one that is on the mesh.");
  AddSurface(pin);
  pin.in("relativeSpaceMatrix", Matrix4(), {.doc = "of relativeSpaceMode custom: its world matrix"});
  pin.structural("coordinateU", 0.0, {.doc = "of each pin"}).array();
  pin.structural("coordinateV", 0.0, {.doc = "of each pin"}).array();
  pin.structural("face", -1,
                 {.min = -1, .doc = "the triangle of the mesh that a pin is in; -1: by its coordinate"})
      .array();
  pin.structural("barycentric", Double3{kThird, kThird, kThird},
                 {.doc = "where in its `face`: shares of the corners, divided by their sum"})
      .array();
  const std::initializer_list<Choice<PinAxis>> axes = {{"x", PinAxis::kX},       {"y", PinAxis::kY},
                                                       {"z", PinAxis::kZ},       {"-x", PinAxis::kMinusX},
                                                       {"-y", PinAxis::kMinusY}, {"-z", PinAxis::kMinusZ}};
  pin.enumeration<PinAxis>("normalAxis", axes, true, "the axis of the matrix that is the surface's normal",
                           PinAxis::kY);
  pin.enumeration<PinAxis>("tangentAxis", axes, true, "the axis that is the direction of growing u");
  pin.enumeration<RelativeSpace>(
      "relativeSpaceMode",
      {{"world", RelativeSpace::kWorld},
       {"local", RelativeSpace::kLocal},
       {"custom", RelativeSpace::kCustom}},
      true, "world; the mesh's own space at the stage; or seen from relativeSpaceMatrix");
  pin.out("outputMatrix", Type::kMatrix, "of each pin: no scale").per_geometry();
  pin.compute<ComputeUvPin>().bind(BindPin<MakeUvPin>).demand(DemandPin<MakeUvPin>).cost(150, 0);

  NodeBuilder follicle = registry.add(
      "follicle", "A frame that rides on a mesh at a uv coordinate: x along growing u, z along the normal.");
  AddSurface(follicle);
  follicle.structural("parameterU", 0.5, {.doc = "its coordinate; outside of the mesh's, the nearest one"});
  follicle.structural("parameterV", 0.5, {.doc = "the same"});
  follicle.structural("face", -1,
                      {.min = -1, .doc = "the triangle of the mesh that it is in; -1: by its coordinate"});
  follicle.structural("barycentric", Double3{kThird, kThird, kThird},
                      {.doc = "where in its `face`: shares of the corners, divided by their sum"});
  follicle.out("outTranslate", Type::kDouble3, "world").unit(Unit::kLength);
  follicle.out("outRotate", Type::kDouble3, "world, in the order xyz").unit(Unit::kAngle);
  follicle.out("outMatrix", Type::kMatrix, "both together");
  follicle.out("outNormal", Type::kDouble3, "world, unit length");
  follicle.out("outTangent", Type::kDouble3, "world, unit length, along growing u");
  follicle.compute<ComputeFollicle>()
      .bind(BindPin<MakeFollicle>)
      .demand(DemandPin<MakeFollicle>)
      .cost(200, 0);
}

}  // namespace kpsa::engine
