#include "kpsa/signals.h"

#include <gtest/gtest.h>

#include "tests/support/test_graph.h"
#include "tests/support/toy_nodes.h"

namespace kpsa::engine {
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

// What a subspace stores of a signal leads back to it, whatever its node is called.
TEST(Signals, EntriesAreReadBackAsTheyAreNamed) {
  for (const std::string node :
       {"jaw", "upperarm01.L", "p/3", "a/b.c/11", "x#1", "ns:hand", "m@s", "größe"}) {
    for (const std::size_t entry : {0u, 3u, 11u}) {
      const SignalEntry matrix = SplitEntryName(EntryName({node + ".matrix", {}, true}, entry));
      EXPECT_EQ(matrix.signal, node + ".matrix");
      EXPECT_EQ(matrix.entry, entry);
    }
    for (const std::string rest : {".envelope", ".weight[a/3]", ".points[3].y", ".weight[/]"}) {
      const SignalEntry value = SplitEntryName(EntryName({node + rest, {}, false}, 0));
      EXPECT_EQ(value.signal, node + rest);
      EXPECT_FALSE(value.entry.has_value());
    }
  }
  for (const std::string name : {"jaw.matrix/", "jaw.matrix/x", "jaw.matrix/3x", "jaw.matrix/-1",
                                 "jaw.matrix/99999999999999999999999"})
    EXPECT_FALSE(SplitEntryName(name).entry.has_value()) << name;
}

}  // namespace
}  // namespace kpsa::engine
