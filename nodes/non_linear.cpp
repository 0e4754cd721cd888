// bend, twist, squash, flare, sine, wave: deformers along the Y axis of a handle. The handle's world matrix
// places and scales the deformation; before a skin, only its motion relative to its parent does, because the
// skin carries the rest.
#include "nodes/kernels/non_linear.h"

#include "nodes/deformer.h"
#include "nodes/node_file.h"

namespace kpsa::engine {
namespace {

constexpr int kHandle = kFirstOwnInput, kFirstSetting = kFirstOwnInput + 1;

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

// `Map` from the settings, which are doubles in the order of its members.
template <typename Map, std::size_t... kSetting>
Map ReadMap(const ComputeContext& c, std::index_sequence<kSetting...>) {
  return {c.get<double>(kFirstSetting + static_cast<int>(kSetting))...};
}

template <typename Map>
void ComputeNonLinear(ComputeContext& c) {
  const auto& bound = c.kernel_as<NonLinearBound>();
  const Matrix4 &parent = c.get<Matrix4>(kParentMatrix), &handle = c.get<Matrix4>(kHandle);
  const CarriedFrame& frame = bound.frame;
  const Matrix4 stage_from_handle =
      frame.fixed() ? frame.stage_from_world() * (frame.parent_rest() * (InverseOrIdentity(parent) * handle))
                    : handle;
  constexpr std::size_t kSettings = sizeof(Map) / sizeof(double);
  const Parallel parallel = HostParallel(c);
  bound.kernel.Run(
      {ReadMap<Map>(c, std::make_index_sequence<kSettings>()), stage_from_handle, c.get<double>(kEnvelope)},
      c.points(kInPoints), c.out_points(0), {}, &parallel);
}

NodeBuilder Begin(NodeRegistry& registry, const char* name, const char* doc) {
  NodeBuilder b = AddDeformer(registry, name, doc);
  b.in("matrix", Matrix4(),
       {.doc = "the handle's world matrix: the deformation is about its Y axis, in its units"})
      .world_place();
  return b;
}

void AddBounds(NodeBuilder& b) {
  b.in("lowBound", -1.0, {.max = 0, .doc = "where it begins on the handle's Y axis"});
  b.in("highBound", 1.0, {.min = 0, .doc = "where it ends"});
}

template <typename Map>
void Finish(NodeBuilder& b) {
  FinishDeformer(b, &ComputeNonLinear<Map>, BindNonLinear).cost(300, 60);
}

void AddRipple(NodeBuilder& b, double wavelength) {
  b.in("amplitude", 0.0, {.doc = "of the waves, in the handle's units"});
  b.in("wavelength", wavelength, {.min = 0, .doc = "of one wave, in the handle's units; 0 makes none"});
  b.in("offset", 0.0, {.doc = "by which the waves are moved outwards"});
  b.in("dropoff", 0.0,
       {.min = -1, .max = 1, .doc = "1: fading from the middle outwards, -1: from outside to the middle"});
}

}  // namespace

KPSA_NODES(non_linear, registry) {
  NodeBuilder bend = Begin(registry, "bend", "Bends points onto a circle, towards the handle's X axis.");
  bend.in("curvature", 0.0, {.unit = Unit::kAngle, .doc = "the turn for each unit of the handle"});
  AddBounds(bend);
  Finish<Bend>(bend);

  NodeBuilder twist = Begin(registry, "twist", "Turns points about the handle's Y axis, more and more.");
  twist.in("startAngle", 0.0, {.unit = Unit::kAngle, .doc = "at the low bound"});
  twist.in("endAngle", 0.0, {.unit = Unit::kAngle, .doc = "at the high bound"});
  AddBounds(twist);
  Finish<Twist>(twist);

  NodeBuilder squash = Begin(registry, "squash",
                             "Stretches or squashes points along the handle's Y axis; they give way across.");
  squash.in("factor", 0.0, {.doc = "1 doubles the length, -1 halves it"});
  squash.in("expand", 1.0, {.doc = "how much they give way; 1 keeps the volume where that is most"});
  squash.in("maxExpandPos", 0.5, {.min = 0.01, .max = 0.99, .doc = "where that is, between the bounds"});
  squash.in("startSmoothness", 0.0,
            {.min = 0, .max = 1, .doc = "1 begins without a corner at the low bound"});
  squash.in("endSmoothness", 0.0, {.min = 0, .max = 1, .doc = "1 ends without a corner at the high bound"});
  AddBounds(squash);
  Finish<Squash>(squash);

  NodeBuilder flare = Begin(registry, "flare", "Scales points across the handle's Y axis.");
  flare.in("startFlareX", 1.0, {.doc = "scale along X at the low bound"});
  flare.in("startFlareZ", 1.0, {.doc = "scale along Z at the low bound"});
  flare.in("endFlareX", 1.0, {.doc = "scale along X at the high bound"});
  flare.in("endFlareZ", 1.0, {.doc = "scale along Z at the high bound"});
  flare.in("curve", 0.0, {.doc = "bulge half way between the bounds, added to the scale"});
  AddBounds(flare);
  Finish<Flare>(flare);

  NodeBuilder sine = Begin(registry, "sine", "Waves along the handle's Y axis, to and fro along its X axis.");
  AddRipple(sine, 2);
  AddBounds(sine);
  Finish<Sine>(sine);

  NodeBuilder wave = Begin(registry, "wave", "Rings around the handle's Y axis, up and down along it.");
  AddRipple(wave, 1);
  wave.in("minRadius", 0.0, {.min = 0, .doc = "where the rings begin, in the handle's units"});
  wave.in("maxRadius", 1.0, {.min = 0, .doc = "where they end"});
  Finish<Wave>(wave);
}

}  // namespace kpsa::engine
