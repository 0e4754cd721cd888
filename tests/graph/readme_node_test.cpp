// The node of the README, word for word.
#include "graph/plugin.h"
#include "tests/support/test_graph.h"

void AddMix(kpsa::NodeRegistry& registry) {
  registry.add("mix", "Blends two values.")
      .in("a", 0.0)
      .in("b", 1.0)
      .in("weight", 0.5, {.min = 0, .max = 1})
      .out("output", kpsa::Type::kDouble)
      .compute([](double a, double b, double weight) { return a + (b - a) * weight; });
}

TEST(Mix, HalfWayIsTheMean) {
  kpsa::NodeRegistry registry;
  AddMix(registry);
  kpsa::TestGraph g(registry);
  g.add("mix", "m", {{"a", 2.0}, {"b", 4.0}});
  EXPECT_DOUBLE_EQ(g.pull<double>("m.output"), 3.0);
}
