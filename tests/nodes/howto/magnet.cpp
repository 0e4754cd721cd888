// magnet: a handle draws points to itself.
#include "nodes/deformer.h"
#include "nodes/node_file.h"
#include "tests/nodes/howto/magnet_kernel.h"

namespace kpsa::engine {
namespace {

struct MagnetBound {
  MagnetKernel kernel;
  CarriedFrame frame;
};

Result<BoundKernel> BindMagnet(const Binding& binding) {
  const Structural& s = binding.structural();
  Result<CarriedFrame> frame = CarriedFrame::Bind(s);
  if (!frame.ok()) return frame.status();
  return MakeBound(MagnetBound{{s.choice<FalloffFade>("curve"), BoundWeights(binding)}, *frame}, 0);
}

void ComputeMagnet(DeformerContext<In<"matrix", Matrix4>, In<"radius", double>> c) {
  const auto& bound = c.kernel_as<MagnetBound>();
  const Matrix4 handle = bound.frame.StageFromHandle(c.get<"parentMatrix">(), c.get<"matrix">());
  const Parallel parallel = HostParallel(c);
  // Lengths are world ones: a stage in mesh space may be scaled
  bound.kernel.Run(
      {TransformPoint(handle, {}), c.get<"radius">() / bound.frame.WorldScale(), c.get<"envelope">()},
      c.get<"inPoints">(), c.out<"outPoints">(), &parallel);
}

void DeclareMagnet(NodeBuilder& b) {
  b.in("matrix", Matrix4(), {.doc = "the handle's world matrix: points go to its place"}).world_place();
  b.in("radius", 0.1, {.min = 0, .unit = Unit::kLength, .doc = "points farther away stay where they are"});
  b.enumeration<FalloffFade>("curve", {{"smooth", FalloffFade::kSmooth}, {"linear", FalloffFade::kLinear}},
                             true, "how the pull gets from nothing at the radius to all of the way");
}

}  // namespace

KPSA_NODES(magnet, registry) {
  AddDeformer<ComputeMagnet>(
      registry,
      {.name = "magnet", .doc = "Draws points to a handle.", .own = DeclareMagnet, .bind = BindMagnet})
      .cost(200, 5);
}

}  // namespace kpsa::engine
