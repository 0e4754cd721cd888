// sculpt: a sphere pushes points out of itself. The sphere is where its handle is; in mesh space, where the
// handle would be had its parent not moved, because the skin carries the points later.
#include "nodes/kernels/sculpt.h"

#include <cmath>

#include "nodes/deformer.h"
#include "nodes/node_file.h"

namespace kpsa::engine {
namespace {

using SculptContext =
    DeformerContext<In<"matrix", Matrix4>, In<"radius", double>, In<"maximumDisplacement", double>,
                    In<"dropoffDistance", double>, In<"stretchOrigin", Double3>>;

struct SculptBound {
  SculptKernel kernel;
  CarriedFrame frame;
  SculptMode mode;
  SculptDropoff dropoff;
};

Result<BoundKernel> BindSculpt(const Binding& binding) {
  const Structural& s = binding.structural();
  const Result<CarriedFrame> frame = CarriedFrame::Bind(s);
  if (!frame.ok()) return frame.status();
  return MakeBound(SculptBound{SculptKernel(binding.output("outPoints").ToVector(), BoundWeights(binding)),
                               *frame, s.choice<SculptMode>("mode"), s.choice<SculptDropoff>("dropoffType")},
                   0);
}

// The cube root, a fifth of a step; of a determinant that is all but 1, of a handle that is not scaled, by its series.
double CubeRoot(double value) {
  const double beyond = value - 1;
  return std::fabs(beyond) < 1e-5 ? 1 + beyond * (1.0 / 3 - beyond * (1.0 / 9)) : std::cbrt(value);
}

void ComputeSculpt(SculptContext c) {
  const auto& bound = c.kernel_as<SculptBound>();
  const double radius = c.get<"radius">();
  const Matrix4& handle = c.get<"matrix">();
  Matrix4 waiting;
  if (bound.frame.fixed()) waiting = bound.frame.StageFromHandle(c.get<"parentMatrix">(), handle);
  SculptKernel::Inputs inputs{{bound.mode, bound.dropoff, 0, 0, {}},
                              bound.frame.fixed() ? waiting : handle,
                              radius,
                              c.get<"envelope">()};
  // Lengths are world ones: the mean radius of the sphere as its handle scales it
  const double size = radius * CubeRoot(std::fabs(Determinant3(handle)));
  if (size > 0) {
    inputs.shape.dropoff_distance = c.get<"dropoffDistance">() / size;
    inputs.shape.max_displacement = c.get<"maximumDisplacement">() / size;
  }
  Matrix4 sphere_from_world;
  if (bound.mode == SculptMode::kStretch && Invert(handle, &sphere_from_world)) {
    const Double3 away = TransformPoint(sphere_from_world, c.get<"stretchOrigin">()) * -1.0;
    const double length = Length(away);
    if (length > 0) inputs.shape.stretch = away * (1 / length);
  }
  const Parallel parallel = HostParallel(c);
  bound.kernel.Run(inputs, c.get<"inPoints">(), c.out<"outPoints">(), &parallel);
}

void DeclareSculpt(NodeBuilder& b) {
  b.in("matrix", Matrix4(), {.doc = "the handle's world matrix: the sphere's centre, axes and scale"})
      .world_place();
  b.in("radius", 0.05, {.min = 0, .unit = Unit::kLength, .doc = "of the sphere, before the handle's scale"});
  b.in("maximumDisplacement", 1.0, {.min = 0, .unit = Unit::kLength, .doc = "no point moves farther"});
  b.in("dropoffDistance", 0.0,
       {.min = 0, .unit = Unit::kLength, .doc = "how far from the sphere's surface points are moved"});
  b.in("stretchOrigin", Double3(),
       {.unit = Unit::kLength, .doc = "of mode stretch, world space: points move away from it"});
  b.enumeration<SculptMode>(
      "mode",
      {{"flip", SculptMode::kFlip}, {"project", SculptMode::kProject}, {"stretch", SculptMode::kStretch}},
      true,
      "flip: points inside go out along their radius; project: points near the surface go onto it; "
      "stretch: points go away from stretchOrigin until they are outside");
  b.enumeration<SculptDropoff>(
      "dropoffType", {{"none", SculptDropoff::kNone}, {"linear", SculptDropoff::kLinear}}, true,
      "none: full strength up to the dropoff distance; linear: fading towards it", SculptDropoff::kLinear);
}

}  // namespace

KPSA_NODES(sculpt, registry) {
  AddDeformer<ComputeSculpt>(registry, {.name = "sculpt",
                                        .doc = "A sphere pushes points out of itself.",
                                        .own = DeclareSculpt,
                                        .bind = BindSculpt})
      .cost(60, 0.75f);
}

}  // namespace kpsa::engine
