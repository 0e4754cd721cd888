#include "nodes/deformer.h"
#include "nodes/kernels/weights.h"
#include "nodes/node_file.h"

namespace kpsa::engine {

KPSA_NODES(tripwire, registry) {
  NodeBuilder b =
      AddDeformer(registry, "tripwire",
                  "Passes points through; fails when it is armed. Shows that a stack was not evaluated.");
  b.in("armed", false, {.doc = "fail instead of passing the points on", .diagnostic = true});
  FinishDeformer(
      b,
      +[](ComputeContext& c) {
        if (c.get<std::int64_t>(kFirstOwnInput) != 0) return c.host->Fail("tripwire: evaluated while armed");
        CopyPoints(c.points(kInPoints), c.out_points(0));
      },
      nullptr)
      .cost(20, 0.3f)
      .passes_points()
      .touches("inPoints", nullptr);  // armed, it fails whatever it weighs
}

}  // namespace kpsa::engine
