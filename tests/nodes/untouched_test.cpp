// Points of weight 0 come out of every deformer bit for bit as they came in, wherever it runs for others: the
// compiler leaves deformers out of plans that want no other points (NodeBuilder::touches).
#include <gtest/gtest.h>

#include <cstring>
#include <set>

#include "tests/nodes/equivariance.h"

namespace kpsa::engine {
namespace {

// Weights 0, 0.7, 1, 0, 0.7, 1 ...
std::shared_ptr<const WeightMap> EveryThirdIsZero(std::size_t points) {
  std::vector<float> weights;
  for (std::size_t i = 0; i < points; ++i) weights.push_back(i % 3 == 0 ? 0.0f : i % 3 == 1 ? 0.7f : 1.0f);
  return std::make_shared<const WeightMap>(std::move(weights));
}

TEST(Untouched, PointsOfWeightZeroKeepTheirBits) {
  std::set<std::string> types, exceptions;
  for (auto* part : {HandleSetUps, SurfaceSetUps}) {
    for (NodeSetUp& set_up : part()) {
      const NodeDef& def = *StandardNodes().Find(set_up.type);
      const GivenInput& in = set_up.given.front();
      if (in.input != "inPoints[0]" || set_up.gives.front().output != "outPoints[0]" || def.stateful)
        continue;
      if (!def.groups.front().touches) {
        exceptions.insert(set_up.type);
        continue;
      }
      SCOPED_TRACE(set_up.Name());
      types.insert(set_up.type);
      const std::vector<float> came = in.now.points()->Interleaved();
      set_up.given.push_back(Setting("weights[0]", EveryThirdIsZero(came.size() / 3)));
      const std::vector<Value> outputs = EvaluateSetUp(set_up, Matrix4(), Matrix4());
      ASSERT_EQ(outputs.size(), 2 * set_up.gives.size());
      const std::vector<float> went = outputs[set_up.gives.size()].points()->Interleaved();
      ASSERT_EQ(went.size(), came.size());
      std::size_t different = 0, moved = 0;
      for (std::size_t i = 0; i < came.size(); i += 3) {
        const bool same = std::memcmp(&came[i], &went[i], 3 * sizeof(float)) == 0;
        (i / 3 % 3 == 0 ? different : moved) += !same;
      }
      EXPECT_EQ(different, 0u);
      EXPECT_GT(moved, 0u);
    }
  }
  EXPECT_GE(types.size(), 15u);
  EXPECT_EQ(exceptions, (std::set<std::string>{"tension", "transformGeometry", "tripwire"}));
}

// So do all points where the envelope is 0, which the compiler leaves out likewise (NodeBuilder::strength):
// here the envelope varies, so that the deformer runs.
TEST(Untouched, AnEnvelopeOfZeroKeepsTheBitsOfAll) {
  std::set<std::string> types;
  for (auto* part : {HandleSetUps, SurfaceSetUps}) {
    for (NodeSetUp& set_up : part()) {
      const NodeDef& def = *StandardNodes().Find(set_up.type);
      const GivenInput& in = set_up.given.front();
      if (in.input != "inPoints[0]" || set_up.gives.front().output != "outPoints[0]" || def.stateful ||
          !def.groups.front().touches || def.groups.front().strength_input < 0)
        continue;
      SCOPED_TRACE(set_up.Name());
      types.insert(set_up.type);
      const std::vector<float> came = in.now.points()->Interleaved();
      set_up.given.push_back({"envelope", Moves::kNot, Value(1.0), Value(0.0)});
      const std::vector<Value> outputs = EvaluateSetUp(set_up, Matrix4(), Matrix4());
      ASSERT_EQ(outputs.size(), 2 * set_up.gives.size());
      const std::vector<float> went = outputs[set_up.gives.size()].points()->Interleaved();
      ASSERT_EQ(went.size(), came.size());
      EXPECT_EQ(std::memcmp(came.data(), went.data(), sizeof(float) * came.size()), 0);
    }
  }
  EXPECT_GE(types.size(), 15u);
}

}  // namespace
}  // namespace kpsa::engine
