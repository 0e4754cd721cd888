// Graphs of a hundred thousand nodes: nothing recurses over a graph.
#include <gtest/gtest.h>

#include "graph/compiler.h"
#include "tests/support/test_graph.h"
#include "tests/support/toy_nodes.h"

namespace kpsa::engine {
namespace {

bool DeepSays(const Status& status, const std::string& part) {
  return status.ToString().find(part) != std::string::npos;
}

TEST(DeepGraphs, AChainOf100000Nodes) {
  constexpr int kCount = 100000;
  TestGraph g(ToyRegistry());
  const NodeDef& def = *ToyRegistry().Find("add");
  const int a = def.FindAttribute("a"), b = def.FindAttribute("b"), out = def.FindAttribute("out");
  std::vector<NodeId> nodes;
  for (int i = 0; i < kCount; ++i) {
    nodes.push_back(*g.graph.AddNode("add", "n" + std::to_string(i)));
    ASSERT_TRUE(g.graph.Set({nodes.back(), b, -1, -1}, 1.0).ok());
  }
  for (std::size_t i = 0; i + 1 < kCount; ++i)
    ASSERT_TRUE(g.graph.Connect({nodes[i], out, -1, -1}, {nodes[i + 1], a, -1, -1}).ok());
  const std::string last = "n" + std::to_string(kCount - 1) + ".out";
  EXPECT_DOUBLE_EQ(g.pull<double>(last), kCount);  // folded
  EXPECT_EQ(g.plan->steps().size(), 0u);
  g.vary("n0.a");
  for (bool parallel : {false, true}) {
    g.plan = nullptr;
    g.options.parallel = parallel;
    g.set("n0.a", 1.0);
    EXPECT_DOUBLE_EQ(g.pull<double>(last), kCount + 1);
    EXPECT_EQ(g.plan->steps().size(), static_cast<std::size_t>(kCount));
  }
  const Status cycle = g.graph.Connect({nodes.back(), out, -1, -1}, {nodes[0], a, -1, -1});
  EXPECT_TRUE(DeepSays(cycle, "n50000.a -> n50000.out"));
  // Remove every other node again
  for (std::size_t i = 1; i < kCount; i += 2) ASSERT_TRUE(g.graph.RemoveNode(nodes[i]).ok());
  EXPECT_EQ(g.graph.Nodes().size(), static_cast<std::size_t>(kCount / 2));
}

TEST(DeepGraphs, AChainOf100000InputsThatDriveEachOther) {
  constexpr int kCount = 100000;
  TestGraph g(ToyRegistry());
  const NodeDef& add = *ToyRegistry().Find("add");
  const NodeDef& scale = *ToyRegistry().Find("scale3");
  const int a = add.FindAttribute("a"), input = scale.FindAttribute("input");
  std::vector<NodeId> nodes, vectors;
  for (int i = 0; i < kCount; ++i) {
    nodes.push_back(*g.graph.AddNode("add", "n" + std::to_string(i)));
    vectors.push_back(*g.graph.AddNode("scale3", "v" + std::to_string(i)));
  }
  for (std::size_t i = 0; i + 1 < kCount; ++i) {
    ASSERT_TRUE(g.graph.Connect({nodes[i], a, -1, -1}, {nodes[i + 1], a, -1, -1}).ok());
    // x of one drives y of the next, so that every vector is assembled; z is driven along
    ASSERT_TRUE(g.graph
                    .Connect({vectors[i], input, -1, static_cast<int>(i % 2)},
                             {vectors[i + 1], input, -1, static_cast<int>((i + 1) % 2)})
                    .ok());
  }
  const std::string last = std::to_string(kCount - 1);
  g.vary("n0.a");
  g.vary("v0.input");
  g.want("n" + last + ".out");
  g.want("v" + last + ".out");
  g.set("n0.a", 3.0);
  g.set("v0.input", Double3{8, 0, 0});
  EXPECT_DOUBLE_EQ(g.pull<double>("n" + last + ".out"), 3);
  EXPECT_EQ(g.pull<Double3>("v" + last + ".out"), (Double3{0, 8, 0}));
  EXPECT_LE(g.plan->steps().size(), 3u);
}

TEST(DeepGraphs, DeformersInPlaceBeyondOneUnit) {
  constexpr int kCount = 100000;
  TestGraph g(ToyRegistry());
  const NodeDef& def = *ToyRegistry().Find("move");
  g.add("source", "src", {{"count", 3}});
  PlugRef from = g.plug("src.outPoints");
  for (int i = 0; i < kCount; ++i) {
    const NodeId node = *g.graph.AddNode("move", "n" + std::to_string(i));
    ASSERT_TRUE(g.graph.Set({node, def.FindAttribute("offset"), -1, -1}, 1.0).ok());
    ASSERT_TRUE(g.graph.Connect(from, {node, def.FindAttribute("points"), -1, -1}).ok());
    from = {node, def.FindAttribute("outPoints"), -1, -1};
  }
  g.vary("src.step");
  g.vary("n70000.offset");
  const std::string last = "n" + std::to_string(kCount - 1) + ".outPoints";
  g.want(last);
  g.set("src.step", 2.0);
  EXPECT_EQ(g.pull_points(last)[3], 2.0f + kCount);
  const std::uint64_t first_unit = g.computes("n5");
  g.set("n70000.offset", 3.0);
  EXPECT_EQ(g.pull_points(last)[3], 4.0f + kCount);
  EXPECT_EQ(g.computes("n5"), first_unit);  // it kept its buffer
  EXPECT_EQ(g.computes("n99999"), 2u);
}

TEST(DeepGraphs, LazyInputsNestDeepButNotWithoutEnd) {
  for (int count : {900, 2000}) {
    TestGraph g(ToyRegistry());
    g.add("add", "root");
    g.vary("root.a");
    std::string from = "root.out";
    for (int i = 0; i < count; ++i) {
      const std::string name = "s" + std::to_string(i);
      g.add("select", name);
      g.connect(from, name + ".a");
      g.connect("root.out", name + ".b");
      g.vary(name + ".which");
      from = name + ".out";
    }
    g.request.varying.resize(1);
    g.vary("s0.which");
    g.want(from);
    if (count == 900) {
      g.set("root.a", 5.0);
      EXPECT_DOUBLE_EQ(g.pull<double>(from), 5);
      EXPECT_EQ(g.computes("s0"), 1u);
    } else {
      EXPECT_TRUE(DeepSays(g.try_pull(from), "lazy inputs are nested more than 1000 deep"))
          << g.try_pull(from).ToString();
    }
  }
}

}  // namespace
}  // namespace kpsa::engine
