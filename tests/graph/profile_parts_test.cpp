// Parts of a step's time, as its node tells them to a profile.
#include "tests/support/test_graph.h"

namespace kpsa::engine {
namespace {

constexpr std::uint64_t kOfDecide = 30, kOfCompute = 700, kAgain = 5;

const NodeRegistry& Parts() {
  static const NodeRegistry* const registry = [] {
    auto* nodes = new NodeRegistry;
    nodes->add("parts", "Says how long its parts take.")
        .in("x", 0.0)
        .in("input", 0.0)
        .array()
        .lazy()
        .out("out", Type::kDouble)
        .compute([](ComputeContext& c) {
          c.out_value<double>(0) = c.get<double>(0);
          c.host->AddPart(2, kOfCompute);
          if (c.host->recording()) c.host->AddPart(2, kAgain);
        })
        .decide([](ComputeContext& c) -> std::uint64_t {
          c.host->AddPart(0, kOfDecide);
          return 0;
        });
    return nodes;
  }();
  return *registry;
}

struct Recorded : ::testing::Test {
  Recorded() : g(Parts()) {
    g.add("parts", "a");
    g.add("parts", "b");
    g.connect("a.out", "b.x");
    g.vary("a.x");
    EXPECT_DOUBLE_EQ(g.pull<double>("b.out"), 0.0);
  }
  Profile::PartTimes Of(const std::string& node) const {
    for (Index s = 0; s < g.plan->steps().size(); ++s) {
      if (node == g.plan->step_name(s)) return g.profile->part_ns()[s];
    }
    ADD_FAILURE() << "no step of " << node;
    return {};
  }
  TestGraph g;
};

TEST_F(Recorded, PartsAreSummedByStep) {
  g.set("a.x", 3.0);
  EXPECT_DOUBLE_EQ(g.pull<double>("b.out"), 3.0);
  g.set("a.x", 4.0);
  EXPECT_DOUBLE_EQ(g.pull<double>("b.out"), 4.0);
  for (const char* node : {"a", "b"})
    EXPECT_EQ(Of(node), (Profile::PartTimes{3 * kOfDecide, 0, 3 * (kOfCompute + kAgain), 0})) << node;
}

TEST_F(Recorded, PartsThatThereAreNotAreIgnored) {
  Profile::PartTimes before = Of("a");
  for (const int part : {-1, ComputeHost::kMaxParts, 1 << 30}) g.profile->AddPart(0, part, 1000);
  EXPECT_EQ(Of("a"), before);
}

TEST_F(Recorded, NothingIsAddedWhileNobodyRecords) {
  g.profile->Clear();
  EXPECT_EQ(Of("a"), Profile::PartTimes{});
  g.evaluator->Record(nullptr);
  g.set("a.x", 3.0);
  EXPECT_DOUBLE_EQ(g.pull<double>("b.out"), 3.0);
  EXPECT_EQ(Of("a"), Profile::PartTimes{});
}

}  // namespace
}  // namespace kpsa::engine
