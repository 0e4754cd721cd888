// bend, twist, squash, flare, sine, wave: deformers along the Y axis of a handle. The handle's world matrix
// places and scales the deformation; before a skin, only its motion relative to its parent does, because the
// skin carries the rest.
#include "nodes/kernels/non_linear.h"

#include "nodes/deformer.h"
#include "nodes/node_file.h"

namespace kpsa::engine {
namespace {

struct NonLinearBound {
  NonLinearKernel kernel;
  CarriedFrame frame;
};

Result<BoundKernel> BindNonLinear(const Binding& binding) {
  Result<CarriedFrame> frame = CarriedFrame::Bind(binding.structural());
  if (!frame.ok()) return frame.status();
  return MakeBound(
      NonLinearBound{NonLinearKernel(binding.output("outPoints").ToVector(), BoundWeights(binding)), *frame},
      0);
}

// `Map` of the settings, the inputs of these names in the order of its members.
template <typename Map, FixedName... kSettings>
void ComputeNonLinear(DeformerContext<In<"matrix", Matrix4>, In<kSettings, double>...> c) {
  static_assert(sizeof(Map) == sizeof...(kSettings) * sizeof(double));
  const auto& bound = c.template kernel_as<NonLinearBound>();
  const Matrix4& handle = c.template get<"matrix">();
  Matrix4 waiting;
  if (bound.frame.fixed()) waiting = bound.frame.StageFromHandle(c.template get<"parentMatrix">(), handle);
  const Parallel parallel = HostParallel(c);
  bound.kernel.Run({Map{c.template get<kSettings>()...}, bound.frame.fixed() ? waiting : handle,
                    c.template get<"envelope">()},
                   c.template get<"inPoints">(), c.template out<"outPoints">(), {}, &parallel);
}

void DeclareHandle(NodeBuilder& b) {
  b.in("matrix", Matrix4(),
       {.doc = "the handle's world matrix: the deformation is about its Y axis, in its units"})
      .world_place();
}

void DeclareBounds(NodeBuilder& b) {
  b.in(
      "lowBound", -1.0,
      {.max = 0,
       .doc = "where it begins on the handle's Y axis, in its units: numbers, that its scale makes lengths"});
  b.in("highBound", 1.0, {.min = 0, .doc = "where it ends, likewise"});
}

void DeclareBend(NodeBuilder& b) {
  DeclareHandle(b);
  b.in("curvature", 0.0, {.unit = Unit::kAngle, .doc = "the turn for each unit of the handle"});
  DeclareBounds(b);
}

void DeclareTwist(NodeBuilder& b) {
  DeclareHandle(b);
  b.in("startAngle", 0.0, {.unit = Unit::kAngle, .doc = "at the low bound"});
  b.in("endAngle", 0.0, {.unit = Unit::kAngle, .doc = "at the high bound"});
  DeclareBounds(b);
}

void DeclareSquash(NodeBuilder& b) {
  DeclareHandle(b);
  b.in("factor", 0.0, {.doc = "1 doubles the length, -1 halves it"});
  b.in("expand", 1.0, {.doc = "how much they give way; 1 keeps the volume where that is most"});
  b.in("maxExpandPos", 0.5, {.min = 0.01, .max = 0.99, .doc = "where that is, between the bounds"});
  b.in("startSmoothness", 0.0, {.min = 0, .max = 1, .doc = "1 begins without a corner at the low bound"});
  b.in("endSmoothness", 0.0, {.min = 0, .max = 1, .doc = "1 ends without a corner at the high bound"});
  DeclareBounds(b);
}

void DeclareFlare(NodeBuilder& b) {
  DeclareHandle(b);
  b.in("startFlareX", 1.0, {.doc = "scale along X at the low bound"});
  b.in("startFlareZ", 1.0, {.doc = "scale along Z at the low bound"});
  b.in("endFlareX", 1.0, {.doc = "scale along X at the high bound"});
  b.in("endFlareZ", 1.0, {.doc = "scale along Z at the high bound"});
  b.in("curve", 0.0, {.doc = "bulge half way between the bounds, added to the scale"});
  DeclareBounds(b);
}

void DeclareRipple(NodeBuilder& b, double wavelength) {
  DeclareHandle(b);
  b.in("amplitude", 0.0, {.doc = "of the waves, in the handle's units"});
  b.in("wavelength", wavelength, {.min = 0, .doc = "of one wave, in the handle's units; 0 makes none"});
  b.in("offset", 0.0, {.doc = "by which the waves are moved outwards"});
  b.in("dropoff", 0.0,
       {.min = -1, .max = 1, .doc = "1: fading from the middle outwards, -1: from outside to the middle"});
}

void DeclareSine(NodeBuilder& b) {
  DeclareRipple(b, 2);
  DeclareBounds(b);
}

void DeclareWave(NodeBuilder& b) {
  DeclareRipple(b, 1);
  b.in("minRadius", 0.0, {.min = 0, .doc = "where the rings begin, in the handle's units"});
  b.in("maxRadius", 1.0, {.min = 0, .doc = "where they end"});
}

template <typename Map, FixedName... kSettings>
void Add(NodeRegistry& registry, const char* name, const char* doc, void (*own)(NodeBuilder&)) {
  AddDeformer<ComputeNonLinear<Map, kSettings...>>(
      registry, {.name = name, .doc = doc, .own = own, .bind = BindNonLinear})
      .cost(50, 1.2f);
}

}  // namespace

KPSA_NODES(non_linear, registry) {
  Add<Bend, "curvature", "lowBound", "highBound">(
      registry, "bend", "Bends points onto a circle, towards the handle's X axis.", DeclareBend);
  Add<Twist, "startAngle", "endAngle", "lowBound", "highBound">(
      registry, "twist", "Turns points about the handle's Y axis, more and more.", DeclareTwist);
  Add<Squash, "factor", "expand", "maxExpandPos", "startSmoothness", "endSmoothness", "lowBound",
      "highBound">(registry, "squash",
                   "Stretches or squashes points along the handle's Y axis; they give way across.",
                   DeclareSquash);
  Add<Flare, "startFlareX", "startFlareZ", "endFlareX", "endFlareZ", "curve", "lowBound", "highBound">(
      registry, "flare", "Scales points across the handle's Y axis.", DeclareFlare);
  Add<Sine, "amplitude", "wavelength", "offset", "dropoff", "lowBound", "highBound">(
      registry, "sine", "Waves along the handle's Y axis, to and fro along its X axis.", DeclareSine);
  Add<Wave, "amplitude", "wavelength", "offset", "dropoff", "minRadius", "maxRadius">(
      registry, "wave", "Rings around the handle's Y axis, up and down along it.", DeclareWave);
}

}  // namespace kpsa::engine
