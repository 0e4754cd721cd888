#include "kpsa/signals.h"

#include <gtest/gtest.h>

#include "tests/support/test_graph.h"
#include "tests/support/toy_nodes.h"

namespace kpsa {
namespace {

TEST(Signals, WhatDependsOnAStatefulNodeIsRefusedByName) {
  TestGraph g(ToyRegistry());
  g.add("trail", "follow");
  g.add("add", "after", {{"b", 1.0}});
  g.add("add", "before", {{"b", 1.0}});
  g.connect("before.out", "follow.input");
  g.connect("follow.out", "after.a");
  Compiler compiler;
  const std::vector<PlugRef> varying = {g.plug("before.a")};
  const Result<std::vector<Signal>> refused =
      FindSignals(g.graph, &compiler, {g.plug("after.out")}, varying, {}, nullptr);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(
      refused.status().ToString(),
      "\"follow\" remembers its previous frame, and a subspace knows poses only: points after it cannot be "
      "accelerated; accelerate a stage before it");
  EXPECT_TRUE(FindSignals(g.graph, &compiler, {g.plug("before.out")}, varying, {}, nullptr).ok());
}

}  // namespace
}  // namespace kpsa
