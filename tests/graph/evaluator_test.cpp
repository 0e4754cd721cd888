#include "graph/evaluator.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/test_graph.h"
#include "tests/support/toy_nodes.h"

namespace kpsa::engine {
namespace {

TEST(Evaluator, ComputesOnceUntilSomethingChanges) {
  TestGraph g(ToyRegistry());
  g.add("add", "a");
  g.add("add", "b", {{"b", 10.0}});
  g.connect("a.out", "b.a");
  g.vary("a.a");
  EXPECT_DOUBLE_EQ(g.pull<double>("b.out"), 10);
  EXPECT_DOUBLE_EQ(g.pull<double>("b.out"), 10);
  EXPECT_EQ(g.computes("a"), 1u);
  g.set("a.a", 3.0);
  g.set("a.a", 4.0);
  EXPECT_EQ(g.computes("b"), 1u);  // nothing runs until somebody pulls
  EXPECT_DOUBLE_EQ(g.pull<double>("b.out"), 14);
  EXPECT_EQ(g.computes("a"), 2u);
  g.set("a.a", 4.0);  // the same value
  g.pull<double>("b.out");
  EXPECT_EQ(g.computes("a"), 2u);
}

TEST(Evaluator, EqualSmallOutputsStopThere) {
  TestGraph g(ToyRegistry());
  g.add("floor", "f");
  g.add("add", "b");
  g.connect("f.out", "b.a");
  g.vary("f.input");
  g.pull<double>("b.out");
  g.set("f.input", 0.5);
  g.pull<double>("b.out");
  EXPECT_EQ(g.computes("f"), 2u);
  EXPECT_EQ(g.computes("b"), 1u);
  g.set("f.input", 1.5);
  EXPECT_DOUBLE_EQ(g.pull<double>("b.out"), 1);
  EXPECT_EQ(g.computes("b"), 2u);
}

TEST(Evaluator, PullRunsOnlyWhatThatOutputNeeds) {
  TestGraph g(ToyRegistry());
  g.add("add", "root");
  g.add("add", "left");
  g.add("add", "right");
  g.connect("root.out", "left.a");
  g.connect("root.out", "right.a");
  g.vary("root.a");
  g.want("left.out");
  g.want("right.out");
  g.pull<double>("left.out");
  EXPECT_EQ(g.computes("right"), 0u);
  g.pull<double>("right.out");
  EXPECT_EQ(g.computes("root"), 1u);
  EXPECT_EQ(g.computes("right"), 1u);
}

// So many outputs, each of what the one before it needs and a step more, that the plan does not keep what every one needs.
TEST(Evaluator, PullsOfAnyOfManyOutputsRunOnlyWhatItNeeds) {
  constexpr int kCount = 400;
  TestGraph g(ToyRegistry());
  std::vector<Index> outputs;
  for (int i = 0; i < kCount; ++i) {
    const std::string name = "a" + std::to_string(i);
    g.add("add", name, {{"b", 1.0}});
    i == 0 ? g.vary("a0.a") : g.connect("a" + std::to_string(i - 1) + ".out", name + ".a");
    outputs.push_back(g.want(name + ".out"));
  }
  ASSERT_TRUE(g.compile().ok());
  ASSERT_FALSE(g.plan->needs(outputs[3]).empty());
  ASSERT_TRUE(g.plan->needs(outputs.back()).empty());
  g.evaluator->Record(g.profile.get());
  double start = 0;
  for (const int i : {399, 3, 398, 250, 398, 399}) {
    g.set("a0.a", ++start);
    ASSERT_TRUE(g.evaluator->Pull(outputs[static_cast<std::size_t>(i)]).ok());
    EXPECT_DOUBLE_EQ(g.evaluator->Get<double>(outputs[static_cast<std::size_t>(i)]), start + i + 1);
  }
  EXPECT_EQ(g.computes("a0"), 6u);
  EXPECT_EQ(g.computes("a4"), 5u);
  EXPECT_EQ(g.computes("a250"), 5u);
  EXPECT_EQ(g.computes("a251"), 4u);
  EXPECT_EQ(g.computes("a399"), 2u);
}

TEST(Evaluator, FoldsWhatDependsOnNothingThatVaries) {
  TestGraph g(ToyRegistry());
  g.add("add", "constant", {{"a", 2.0}, {"b", 3.0}});
  g.add("add", "varies");
  g.connect("constant.out", "varies.b");
  g.vary("varies.a");
  EXPECT_DOUBLE_EQ(g.pull<double>("varies.out"), 5);
  EXPECT_EQ(g.plan->steps().size(), 1u);
  ASSERT_EQ(g.plan->excluded().size(), 1u);
  EXPECT_EQ(g.plan->excluded()[0].node_name, "constant");
  // A plug that was not named as varying cannot be set
  const Result<PlugHandle> varying = g.evaluator->FindVarying(g.graph, g.plug("constant.a"));
  ASSERT_FALSE(varying.ok());
  EXPECT_NE(varying.status().ToString().find("constant.a"), std::string::npos);
}

TEST(Evaluator, ValuesFromOutsideAreCheckedAndARefusedOneChangesNothing) {
  NodeRegistry registry;
  registry.add("mixed", "One of each.")
      .in("v", Double3{1, 2, 3}, {.min = -10, .max = 10})
      .in("q", Quaternion{})
      .in("count", 2)
      .in("on", true)
      .enumeration("side", {"left", "right"}, false)
      .out("out", Type::kDouble)
      .compute([](const Double3& v, const Quaternion& q, int count, bool on, int side) {
        return v.x + 10 * v.y + 100 * v.z + q.w + count + (on ? 1000 : 0) + 10000 * side;
      });
  TestGraph g(registry);
  g.add("mixed", "n");
  for (const char* plug : {"n.v", "n.q", "n.count", "n.on", "n.side"}) g.vary(plug);
  EXPECT_EQ(g.pull<double>("n.out"), 1324);
  const auto set = [&](const char* name, const Value& value) {
    const Result<PlugHandle> handle = g.evaluator->FindVarying(g.graph, g.plug(name));
    EXPECT_TRUE(handle.ok()) << handle.status().ToString();
    return g.evaluator->Set(*handle, value).ToString();
  };
  // A component, by the handle of its plug: this aborted the host
  EXPECT_EQ(set("n.v.y", 5.0), "");
  EXPECT_EQ(g.pull<double>("n.out"), 1354);
  EXPECT_EQ(set("n.v.z", 4), "");
  EXPECT_EQ(set("n.on", 0.0), "");
  EXPECT_EQ(set("n.side", 1), "");
  EXPECT_EQ(set("n.count", 7.0), "");
  EXPECT_EQ(g.pull<double>("n.out"), 10459);

  EXPECT_EQ(set("n.v", 5.0), "n.v: expected double3, got 5");
  EXPECT_EQ(set("n.v.y", Double3{1, 1, 1}), "n.v.y: expected double, got [1, 1, 1]");
  EXPECT_EQ(set("n.v.x", 11.0), "n.v.x: 11 is outside of [-10, 10]");
  EXPECT_EQ(set("n.v.x", std::nan("")), "n.v.x: expected a finite value, got nan");
  EXPECT_EQ(set("n.q", Double3{}), "n.q: expected quaternion, got [0, 0, 0]");
  EXPECT_EQ(set("n.count", 2.5), "n.count: expected int, got 2.5");
  EXPECT_EQ(set("n.count", 1e300), "n.count: expected int, got 1e+300");
  EXPECT_EQ(set("n.on", 2), "n.on: 2 is outside of [0, 1]");
  EXPECT_EQ(set("n.side", 2), "n.side: 2 is outside of [0, 1]");
  EXPECT_EQ(set("n.side", "left"), "n.side: expected enum, got left");
  EXPECT_FALSE(g.evaluator->Set(PlugHandle(), 1.0).ok());
  EXPECT_FALSE(g.evaluator->Set(PlugHandle{999, -1, Type::kDouble}, 1.0).ok());
  EXPECT_FALSE(g.evaluator->Set(PlugHandle{0, 7, Type::kDouble}, 1.0).ok());
  EXPECT_FALSE(g.evaluator->Set(PlugHandle{0, -1, Type::kMatrix}, Matrix4{}).ok());
  EXPECT_FALSE(g.evaluator->SetPoints(PlugHandle{0, -1, Type::kDouble3}, {}).ok());
  EXPECT_EQ(g.pull<double>("n.out"), 10459);
  EXPECT_EQ(g.computes("n"), 3u) << "a refused value made something stale";
}

TEST(Evaluator, ElementsOfPointArraysVaryByThemselves) {
  NodeRegistry registry;
  registry.add("last", "Coordinates of two.")
      .points_in("sheets")
      .array()
      .out("out", Type::kDouble)
      .compute([](ComputeContext& c) {
        const ArrayView<ConstPointsView> sheets = c.array<ConstPointsView>(0);
        c.out_value<double>(0) = 10.0 * sheets[0].x[0] + sheets[1].x[0];
      })
      .demand([](Demand& demand) {
        for (int i : {0, 1}) demand.Require("sheets", i, PointSet::All(1));
      });
  TestGraph g(registry);
  const auto at = [](float x) {
    return std::make_shared<PointBuffer>(PointBuffer::FromInterleaved(std::vector<float>{x, 0, 0}));
  };
  g.add("last", "n", {{"sheets[0]", PointBufferPtr(at(1))}, {"sheets[1]", PointBufferPtr(at(2))}});
  for (const char* plug : {"n.sheets[0]", "n.sheets[1]"}) g.vary(plug);
  EXPECT_EQ(g.pull<double>("n.out"), 12);
  EXPECT_TRUE(
      g.evaluator->SetPoints(*g.evaluator->FindVarying(g.graph, g.plug("n.sheets[1]")), at(5)->view()).ok());
  EXPECT_EQ(g.pull<double>("n.out"), 15);
  EXPECT_TRUE(
      g.evaluator->SetPoints(*g.evaluator->FindVarying(g.graph, g.plug("n.sheets[0]")), at(3)->view()).ok());
  EXPECT_EQ(g.pull<double>("n.out"), 35);
  const PlugHandle whole = *g.evaluator->FindVarying(g.graph, g.plug("n.sheets[0]"));
  const PointBuffer two = PointBuffer::FromInterleaved(std::vector<float>(6));
  EXPECT_EQ(g.evaluator->SetPoints(whole, two.view()).ToString(), "n.sheets[0]: expected 1 points, got 2");
  EXPECT_EQ(g.evaluator->SetPoints(whole, at(std::nanf(""))->view()).ToString(),
            "n.sheets[0]: expected finite points");
}

TEST(Evaluator, ChildrenOfVectorsAsSourcesAndDestinations) {
  TestGraph g(ToyRegistry());
  g.add("scale3", "s", {{"input", Double3{1, 2, 3}}, {"factor", 2.0}});
  g.add("scale3", "t", {{"input", Double3{0, 0, 7}}});
  g.connect("s.out.y", "t.input.x");
  g.connect("s.outZ", "t.inputY");
  g.vary("s.factor");
  g.vary("t.input.z");
  EXPECT_EQ(g.pull<Double3>("t.out"), (Double3{4, 6, 7}));
  g.set("s.factor", 3.0);
  g.set("t.input.z", 1.0);
  EXPECT_EQ(g.pull<Double3>("t.out"), (Double3{6, 9, 1}));
}

TEST(Evaluator, SelectorThatFlipsAfterTenUnpulledFrames) {
  TestGraph g(ToyRegistry());
  g.add("add", "time");
  g.add("add", "left");
  g.add("add", "right", {{"b", 100.0}});
  g.add("select", "s");
  g.connect("time.out", "left.a");
  g.connect("time.out", "right.a");
  g.connect("left.out", "s.a");
  g.connect("right.out", "s.b");
  g.vary("time.a");
  g.vary("s.which");
  EXPECT_DOUBLE_EQ(g.pull<double>("s.out"), 0);
  EXPECT_EQ(g.computes("right"), 0u);
  for (int frame = 1; frame <= 10; ++frame) g.set("time.a", static_cast<double>(frame));
  g.set("s.which", 1);
  EXPECT_DOUBLE_EQ(g.pull<double>("s.out"), 110);
  EXPECT_EQ(g.computes("left"), 1u);
  EXPECT_EQ(g.computes("right"), 1u);
  EXPECT_EQ(g.computes("time"), 2u);
  g.set("s.which", 0);
  EXPECT_DOUBLE_EQ(g.pull<double>("s.out"), 10);
  EXPECT_EQ(g.computes("left"), 2u);
  EXPECT_EQ(g.computes("right"), 1u);
}

TEST(Evaluator, TwoConsumersWithDifferentSubsetsAndALazyFullBranch) {
  for (bool parallel : {false, true}) {
    TestGraph g(ToyRegistry());
    g.options.parallel = parallel;
    g.add("source", "src", {{"count", 100}});
    g.add("move", "m1");
    g.add("smooth", "ring", {{"rings", 2}});
    g.add("cached", "cache", {{"cues", std::vector<std::int64_t>{5, 50}}, {"threshold", 1000.0}});
    g.add("measure", "probe");
    g.connect("src.outPoints", "m1.points");
    g.connect("m1.outPoints", "ring.points");
    g.connect("ring.outPoints", "cache.cuePoints");
    g.connect("ring.outPoints", "cache.full");
    g.vary("m1.offset");
    g.want("cache.outPoints");
    g.want("m1.outPoints", PointSet::Of({7, 8}, 100));
    g.pull_points("cache.outPoints");
    EXPECT_FLOAT_EQ(g.pull_points("cache.outPoints")[0], 27.5f);
    // Eager: the rings of 2 cues and the 2 points that are asked for; the full branch never ran
    Index eager = 0, full = 0;
    for (Index s = 0; s < g.plan->steps().size(); ++s) {
      if (std::string(g.plan->step_name(s)) != "m1" || *g.plan->step_label(s) != 0) continue;
      (g.plan->infos()[s].segment == 0 ? eager : full) = g.plan->infos()[s].points;
    }
    EXPECT_EQ(eager, 11u);  // 3..7 and 48..52, and 8
    EXPECT_EQ(full, 100u);
    EXPECT_EQ(g.computes("ring"), 1u);
    g.set("m1.offset", 1000.0);
    EXPECT_FLOAT_EQ(g.pull_points("cache.outPoints")[3 * 20], 1020.0f);
    EXPECT_EQ(g.computes("ring"), 3u);  // 2 cues twice, and the full one
    EXPECT_FLOAT_EQ(g.pull_points("m1.outPoints")[3], 1008.0f);
  }
}

TEST(Evaluator, MidStageReaderUnderAnInPlaceChain) {
  std::vector<float> expected;
  for (bool parallel : {false, true}) {
    TestGraph g(ToyRegistry());
    g.options.parallel = parallel;
    g.add("source", "src", {{"count", 64}});
    for (const char* name : {"m1", "m2", "m3"}) g.add("move", name);
    g.add("cached", "cue", {{"cues", std::vector<std::int64_t>{1, 2}}, {"threshold", 1e9}});
    g.connect("src.outPoints", "m1.points");
    g.connect("m1.outPoints", "m2.points");
    g.connect("m2.outPoints", "m3.points");
    g.connect("m1.outPoints", "cue.cuePoints");
    g.connect("m3.outPoints", "cue.full");
    for (const char* name : {"m1.offset", "m2.offset", "m3.offset", "src.step"}) g.vary(name);
    g.want("m3.outPoints");
    g.want("cue.outPoints");
    g.set("m1.offset", 10.0);
    g.set("m2.offset", 100.0);
    EXPECT_FLOAT_EQ(g.pull_points("m3.outPoints")[3 * 4], 114.0f);
    EXPECT_FLOAT_EQ(g.pull_points("cue.outPoints")[0], 11.5f);
    g.set("m3.offset", 1000.0);  // late in the chain: it runs again from its last kept buffer
    EXPECT_FLOAT_EQ(g.pull_points("m3.outPoints")[3 * 4], 1114.0f);
    EXPECT_FLOAT_EQ(g.pull_points("cue.outPoints")[0], 11.5f);
    EXPECT_EQ(g.computes("cue"), 1u);
    EXPECT_EQ(g.computes("m1"), 2u);
    g.set("src.step", 2.0);
    const std::vector<float> points = g.pull_points("m3.outPoints");
    EXPECT_FLOAT_EQ(points[3 * 4], 1118.0f);
    EXPECT_FLOAT_EQ(g.pull_points("cue.outPoints")[0], 13.0f);
    if (expected.empty()) expected = points;
    EXPECT_EQ(points, expected);
    // One buffer serves the whole chain
    EXPECT_EQ(g.computes("m1", "gather"), 3u);
  }
}

TEST(Evaluator, AFailureNamesItsNodeAndHealsWithItsInput) {
  TestGraph g(ToyRegistry());
  g.add("fail", "f");
  g.add("add", "after");
  g.add("add", "other");
  g.connect("f.out", "after.a");
  g.vary("f.input");
  g.vary("other.a");
  g.want("after.out");
  g.want("other.out");
  g.set("f.input", -1.0);
  const Status status = g.try_pull("after.out");
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.kind(), ErrorKind::kEvaluation);
  EXPECT_NE(status.ToString().find("\"f\""), std::string::npos);
  EXPECT_TRUE(g.try_pull("other.out").ok());
  EXPECT_FALSE(g.try_pull("after.out").ok());
  g.set("f.input", 2.0);
  EXPECT_DOUBLE_EQ(g.pull<double>("after.out"), 2);
}

TEST(Evaluator, EvaluatorsShareAWorkspace) {
  TestGraph g(ToyRegistry());
  g.add("source", "src", {{"count", 100}});
  g.add("move", "m1");
  g.add("smooth", "ring");
  g.add("cached", "cache", {{"cues", std::vector<std::int64_t>{5}}, {"threshold", -1.0}});
  g.connect("src.outPoints", "m1.points");
  g.connect("m1.outPoints", "ring.points");
  g.connect("ring.outPoints", "cache.cuePoints");
  g.connect("ring.outPoints", "cache.full");
  g.vary("m1.offset");
  g.vary("cache.threshold");
  g.want("cache.outPoints");
  ASSERT_TRUE(g.compile().ok());
  Workspace workspace(*g.plan);
  EvaluatorOptions options;
  options.workspace = &workspace;
  Evaluator a(g.plan, options), b(g.plan, options);
  for (int round = 0; round < 3; ++round) {
    a.Set(0, 1.0 + round);
    ASSERT_TRUE(a.Evaluate().ok());
    b.Set(0, 2.0);
    b.Set(1, -2.0 - round);
    ASSERT_TRUE(b.Evaluate().ok());
    a.Set(1, -5.0 - round);  // the full branch is stale only because b used the workspace
    ASSERT_TRUE(a.Evaluate().ok());
    EXPECT_FLOAT_EQ(a.Points(0).x[50], 51.0f + static_cast<float>(round));
    EXPECT_FLOAT_EQ(b.Points(0).x[50], 52.0f);
  }
}

TEST(Evaluator, WhatAnotherTookOfTheWorkspaceStillHearsOfChanges) {
  // Two caches; more varying plugs than there are closures kept for, so that changes are walked
  TestGraph g(ToyRegistry());
  g.add("sum", "many");
  std::string end = "many.out";
  for (int i = 0; i < 300; ++i) {
    const std::string n = std::to_string(i);
    g.add("add", "n" + n);
    g.connect(end, "n" + n + ".a");
    end = "n" + n + ".out";
    g.hold("many.input[" + n + "]", 0.0);
    g.vary("many.input[" + n + "]");
  }
  g.want(end);
  g.add("source", "src", {{"count", 100}});
  for (const std::string name : {"one", "two"}) {
    g.add("move", name + "_full");
    g.add("cached", name, {{"cues", std::vector<std::int64_t>{5}}, {"threshold", -1.0}});
    g.connect("src.outPoints", name + "_full.points");
    g.connect("src.outPoints", name + ".cuePoints");
    g.connect(name + "_full.outPoints", name + ".full");
    g.vary(name + ".threshold");
    g.vary(name + "_full.offset");
    g.want(name + ".outPoints");
  }
  ASSERT_TRUE(g.compile().ok());
  const Index one_threshold = 300, one_offset = 301, two_offset = 303;
  ASSERT_TRUE(g.plan->closure(two_offset).empty());
  Workspace workspace(*g.plan);
  Evaluator a(g.plan, {false, &workspace}), b(g.plan, {false, &workspace});
  a.Set(one_threshold, 1e9);  // two's full points only
  ASSERT_TRUE(a.Evaluate().ok());
  ASSERT_TRUE(b.Evaluate().ok());
  a.Set(one_threshold, -1.0);  // one's, too: b has used the workspace since
  a.Set(one_offset, 1.0);
  ASSERT_TRUE(a.Evaluate().ok());
  EXPECT_FLOAT_EQ(a.Points(1).x[50], 51.0f);
  EXPECT_FLOAT_EQ(a.Points(2).x[50], 50.0f);
  a.Set(two_offset, 2.0);
  ASSERT_TRUE(a.Evaluate().ok());
  EXPECT_FLOAT_EQ(a.Points(2).x[50], 52.0f);
}

}  // namespace
}  // namespace kpsa::engine
