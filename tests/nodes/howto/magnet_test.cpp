// The deformer of docs/howto/deformer.md.
#include <gtest/gtest.h>

#include "graph/geometry.h"
#include "nodes/node_file.h"
#include "tests/nodes/howto/magnet_kernel.h"
#include "tests/nodes/node_support.h"

namespace kpsa::engine {

KPSA_NODES(magnet, registry);

namespace {

const NodeRegistry& Magnets() {
  static NodeRegistry registry;
  if (registry.Find("magnet") == nullptr) AddNodesOf_magnet(registry);
  return registry;
}

TEST(MagnetKernel, LeavesPointsWithoutAWeightBitForBit) {
  const PointBuffer in = PointBuffer::FromInterleaved(std::vector<float>{0.1f, 0, 0, 0.1f, 0, 0, 7, 0, 0});
  PointBuffer out(3);
  const MagnetKernel kernel(FalloffFade::kLinear, {1, 0, 1});
  kernel.Run({{0, 0, 0}, 0.2, 1}, in.view(), out.view(), nullptr);
  EXPECT_FLOAT_EQ(out.view().x[0], 0.05f) << "half of the radius away: half of the way";
  EXPECT_EQ(out.view().x[1], 0.1f) << "no weight";
  EXPECT_EQ(out.view().x[2], 7.0f) << "beyond the radius";
}

TEST(Magnet, DrawsPointsToItsHandle) {
  TestGraph g(Magnets());
  g.add("magnet", "m",
        {{"inPoints[0]", PointsOf({0, 0, 0, 1, 0, 0, 3, 0, 0})}, {"radius", 2.0}, {"curve", "linear"}});
  g.vary("m.matrix");
  g.vary("m.envelope");
  ExpectPoints(g.pull_points("m.outPoints[0]"), {0, 0, 0, 0.5, 0, 0, 3, 0, 0});
  g.set("m.matrix", Translation({0, 1, 0}));
  ExpectPoints(g.pull_points("m.outPoints[0]"),
               {0, 0.5, 0, 1 - (1 - std::sqrt(0.5)), 1 - std::sqrt(0.5), 0, 3, 0, 0});
  g.set("m.envelope", 0.0);
  ExpectPoints(g.pull_points("m.outPoints[0]"), {0, 0, 0, 1, 0, 0, 3, 0, 0}, 0);
}

TEST(Magnet, BeforeASkinItsParentCarriesItAlong) {
  TestGraph g(Magnets());
  g.add("magnet", "m",
        {{"inPoints[0]", PointsOf({1, 0, 0})}, {"radius", 2.0}, {"curve", "linear"}, {"space", "mesh"}});
  g.vary("m.matrix");
  g.vary("m.parentMatrix");
  ExpectPoints(g.pull_points("m.outPoints[0]"), {0.5, 0, 0});
  const Matrix4 head = Translation({5, 5, 5});
  g.set("m.matrix", head);
  g.set("m.parentMatrix", head);
  ExpectPoints(g.pull_points("m.outPoints[0]"), {0.5, 0, 0});  // the skin moves the point later
}

}  // namespace
}  // namespace kpsa::engine
