#include "nodes/deformer.h"
#include "nodes/kernels/weights.h"
#include "nodes/node_file.h"

namespace kpsa::engine {
namespace {

void ComputeTripwire(DeformerContext<In<"armed", bool>> c) {
  if (c.get<"armed">()) return c.Fail("tripwire: evaluated while armed");
  CopyPoints(c.get<"inPoints">(), c.out<"outPoints">());
}

void DeclareArmed(NodeBuilder& b) {
  b.in("armed", false, {.doc = "fail instead of passing the points on", .diagnostic = true});
}

}  // namespace

KPSA_NODES(tripwire, registry) {
  AddDeformer<ComputeTripwire>(
      registry,
      {.name = "tripwire",
       .doc = "Passes points through; fails when it is armed. Shows that a stack was not evaluated.",
       .own = DeclareArmed})
      .cost(20, 0.3f)
      .passes_points()
      .touches("inPoints", nullptr);  // armed, it fails whatever it weighs
}

}  // namespace kpsa::engine
