// Recording that is off costs nothing: the shipped evaluator executes hardly more instructions than the same
// code compiled without any recording (evaluator_without_recording.cpp).
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>

#include "tests/graph/evaluator_without_recording.h"
#include "tests/support/instruction_count.h"
#include "tests/support/test_graph.h"
#include "tests/support/toy_nodes.h"

namespace kpsa::engine {
namespace {

// Counting takes microseconds an instruction. What recording costs once an evaluation shows the more the
// fewer nodes there are, what it costs a node shows at any number; KPSA_RECORDING_NODES=10000 counts at the
// size of the goal.
int NodeCount() {
  const char* text = std::getenv("KPSA_RECORDING_NODES");
  return text == nullptr ? 300 : std::clamp(std::atoi(text), 200, 100000);
}

TEST(InstructionCount, IsExactAndTheSameEveryTime) {
  volatile int sink = 0;
  const auto loop = [&](int count) {
    return CountInstructions([&sink, count] {
      for (int i = 0; i < count; ++i) sink = i;
    });
  };
  const auto ten = loop(10);
  if (!ten.has_value()) GTEST_SKIP() << "instructions cannot be counted here";
  EXPECT_EQ(loop(10), ten);
  const std::uint64_t each = (*loop(1010) - *ten) / 1000;
  EXPECT_GE(each, 2u);
  EXPECT_EQ(*loop(2010) - *ten, 2000 * each);
}

TEST(Recording, CostsNothingWhileItIsOff) {
  const int count = NodeCount();
  TestGraph g(ToyRegistry());
  std::vector<NodeId> nodes;
  const NodeDef& def = *ToyRegistry().Find("add");
  const int a = def.FindAttribute("a"), b = def.FindAttribute("b"), out = def.FindAttribute("out");
  for (int i = 0; i < count; ++i) {
    nodes.push_back(g.add("add", "n" + std::to_string(i)));
    for (int from : {i - 100, i - 101 + i % 2}) {  // layers of a hundred
      if (from < 0) continue;
      const PlugRef source{nodes[static_cast<std::size_t>(from)], out, -1, -1};
      ASSERT_TRUE(g.graph.Connect(source, {nodes.back(), from == i - 100 ? a : b, -1, -1}, true).ok());
    }
    if (i < 100) g.request.varying.push_back({nodes.back(), a, -1, -1});
    if (i >= count - 100) g.request.outputs.push_back({{nodes.back(), out, -1, -1}, {}});
  }
  Result<std::shared_ptr<const Plan>> plan = g.compiler.Compile(g.graph, g.request);
  ASSERT_TRUE(plan.ok()) << plan.status().ToString();
  ASSERT_EQ((*plan)->steps().size(), static_cast<std::size_t>(count));

  Evaluator shipped(*plan);
  WithoutRecording bare(*plan);
  ASSERT_TRUE(shipped.Evaluate().ok());
  ASSERT_TRUE(bare.Evaluate().ok());
  const auto instructions = [](auto& evaluator) {
    evaluator.Invalidate();
    return CountInstructions([&] { EXPECT_TRUE(evaluator.Evaluate().ok()); });
  };
  const std::optional<std::uint64_t> off = instructions(shipped), without = instructions(bare);
  if (!off.has_value() || !without.has_value()) GTEST_SKIP() << "instructions cannot be counted here";
  Profile profile(**plan);
  shipped.Record(&profile);
  const std::optional<std::uint64_t> on = instructions(shipped);
  EXPECT_EQ(profile.counts()[static_cast<std::size_t>(count / 2)], 1u);  // it did evaluate
  const auto a_node = [&](std::optional<std::uint64_t> total) { return static_cast<double>(*total) / count; };
  std::printf("instructions a node: %.1f without recording code, %.1f with recording off, %.1f on\n",
              a_node(without), a_node(off), a_node(on));
  EXPECT_GT(a_node(without), 20);
  EXPECT_LE(static_cast<double>(*off), 1.01 * static_cast<double>(*without));
  EXPECT_GT(static_cast<double>(*on),
            1.3 * static_cast<double>(*off));  // the comparison sees recording where there is some
}

}  // namespace
}  // namespace kpsa::engine
