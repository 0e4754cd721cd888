#include "graph/compiler.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/test_graph.h"
#include "tests/support/toy_nodes.h"

namespace kpsa::engine {
namespace {

bool Says(const Status& status, const std::string& part) {
  return status.ToString().find(part) != std::string::npos;
}

class CompilerTest : public testing::Test {
 protected:
  CompilerTest() : g(ToyRegistry()) {}
  std::string Reason(const std::string& node) {
    for (const Plan::Excluded& e : g.plan->excluded()) {
      if (e.node_name == node) return e.reason;
    }
    return "";
  }
  TestGraph g;
};

TEST_F(CompilerTest, RequestsThatNameWhatCannotVary) {
  g.add("add", "a");
  g.add("add", "b");
  g.add("grid", "g");
  g.connect("a.out", "b.a");
  g.vary("b.a");
  EXPECT_EQ(g.try_pull("b.out").ToString(), "b.a is driven by a.out and cannot vary by itself");
  g.request.varying = {g.plug("a.out")};
  EXPECT_EQ(g.try_pull("b.out").ToString(), "a.out is an output and cannot vary by itself");
  g.request.varying = {g.plug("g.divisions")};
  EXPECT_EQ(g.try_pull("b.out").ToString(), "g.divisions is structural and cannot vary");
  g.request.varying = {g.plug("a.a")};
  g.request.outputs.push_back({g.plug("g.divisions"), {}});
  EXPECT_EQ(g.try_pull("b.out").ToString(), "g.divisions is structural and has no value at run time");
  g.request.outputs.pop_back();
  ASSERT_TRUE(g.compile().ok());
  // Setting what the request did not name
  const Result<PlugHandle> varying = g.evaluator->FindVarying(g.graph, g.plug("b.b"));
  EXPECT_EQ(varying.status().ToString(), "b.b does not vary in this plan: name it in Request::varying");
}

TEST_F(CompilerTest, ConstantsBecomeWholeNumbersAsVaryingOnesDo) {
  g.add("add", "n");
  g.add("choice", "c");
  g.connect("n.out", "c.selector");
  for (const auto& [number, whole] :
       {std::pair(-3.9, -3), std::pair(1e30, 0), std::pair(-1e30, 0), std::pair(1e300 * 1e300, 0)}) {
    g.request.varying.clear();
    g.hold("n.a", std::isfinite(number) ? number : 1e308);
    g.hold("n.b", std::isfinite(number) ? 0.0 : 1e308);
    EXPECT_EQ(g.pull<std::int64_t>("c.selector"), whole) << number;
    g.vary("n.a");
    EXPECT_EQ(g.pull<std::int64_t>("c.selector"), whole) << number;
  }
}

TEST_F(CompilerTest, StructuralDrivenByWhatVariesNamesBothEnds) {
  g.add("add", "frame");
  g.add("add", "half");
  g.add("source", "src");
  g.connect("frame.out", "half.a");
  g.connect("half.out", "src.count");
  EXPECT_EQ(g.pull_points("src.outPoints").size(), 0u);  // constants may drive it
  g.hold("frame.a", 3.9);
  EXPECT_EQ(g.pull_points("src.outPoints").size(), 9u);  // toward zero
  g.vary("frame.a");
  EXPECT_EQ(g.try_pull("src.outPoints").ToString(),
            "src.count is structural (it is baked into the plan) and cannot be driven by node \"half\", "
            "which varies");
  ASSERT_TRUE(g.graph.Connect(g.plug("frame.a"), g.plug("src.count"), true).ok());
  EXPECT_TRUE(Says(g.try_pull("src.outPoints"), "node \"frame\"")) << g.try_pull("src.outPoints").ToString();
}

TEST_F(CompilerTest, FailuresWhileCompilingNameTheirNode) {
  g.add("source", "src");
  g.add("picky", "p");
  g.connect("src.outPoints", "p.points");
  g.vary("src.step");
  const char* reasons[] = {"", "node \"p\" (picky): cannot bind",
                           "node \"p\" (picky): points asks for points of an array of 3, its input has 10",
                           "node \"p\" (picky): cannot count"};
  for (int where = 1; where <= 3; ++where) {
    g.hold("p.where", where);
    EXPECT_EQ(g.try_pull("p.outPoints").ToString(), reasons[where]);
  }
  g.hold("p.where", 4);
  const Status status = g.try_pull("p.outPoints");
  EXPECT_EQ(status.ToString(), "node \"p\" (picky): cannot compute");
  EXPECT_EQ(status.kind(), ErrorKind::kEvaluation);
  // The same where it is folded
  g.request.varying.clear();
  g.plan = nullptr;
  EXPECT_EQ(g.try_pull("p.outPoints").ToString(), "node \"p\" (picky): cannot compute");
  g.hold("p.where", 0);
  EXPECT_EQ(g.pull_points("p.outPoints")[3], 2.0f);
}

TEST(StructuralDrivers, AFailedOneIsToldWithItsNodeAndThePlug) {
  NodeRegistry registry;
  AddToyNodes(registry);
  registry.add("badMatrix", "Fails.")
      .in("input", 0.0)
      .out("out", Type::kMatrix)
      .compute([](ComputeContext& c) { c.host->Fail("no matrix"); });
  // Reads the matrix while it counts, demands, binds: nowhere may there be none
  for (const int where : {0, 1, 2}) {
    const std::string type = fmt::format("framed{}", where);
    NodeBuilder framed = registry.add(type, "Reads a structural matrix.");
    framed.points_in("points").structural("frame", Matrix4()).out("outPoints", Type::kPoints);
    framed.compute([](ComputeContext&) {});
    const auto read = [](const Structural& s) { return s.value("frame").get<Matrix4>().m[0]; };
    if (where == 0)
      framed.point_count([=](const Structural& s, std::string_view, int) -> Result<Index> {
        return static_cast<Index>(read(s));
      });
    if (where == 1)
      framed.demand([=](Demand& d) {
        if (read(d.structural()) == 1) d.Require("points", 0, d.output("outPoints"));
      });
    if (where == 2)
      framed.bind([=](const Binding& b) -> Result<BoundKernel> {
        return BoundKernel{std::make_shared<double>(read(b.structural())), 0, 0};
      });
    TestGraph g(registry);
    g.add("source", "src", {{"count", 3}});
    g.add("badMatrix", "bad");
    g.add(type, "p");
    g.connect("src.outPoints", "p.points");
    g.connect("bad.out", "p.frame");
    g.vary("src.step");
    const Status status = g.try_pull("p.outPoints");
    ASSERT_FALSE(status.ok()) << where;
    EXPECT_EQ(status.ToString(), "node \"bad\" (badMatrix): no matrix; it drives p.frame") << where;
    EXPECT_EQ(status.errors()[0].node, "bad");
  }
}

TEST(StructuralDrivers, OfAnEarlierFailureIsNotToldAsTheOnesOfAnother) {
  NodeRegistry registry;
  AddToyNodes(registry);
  registry.add("badMatrix", "Fails.")
      .in("input", 0.0)
      .out("out", Type::kMatrix)
      .compute([](ComputeContext& c) { c.host->Fail("no matrix"); });
  registry.add("goodMatrix", "").in("input", 0.0).out("out", Type::kMatrix).compute([](ComputeContext& c) {
    c.out_value<Matrix4>(0) = Matrix4();
  });
  registry.add("rests", "Looks at what fails at rest, then at a structural matrix.")
      .in("m", Matrix4())
      .structural("frame", Matrix4())
      .out("out", Type::kDouble)
      .compute([](ComputeContext&) {})
      .bind([](const Binding& b) -> Result<BoundKernel> {
        EXPECT_EQ(b.structural().rest("m"), nullptr);
        return BoundKernel{std::make_shared<Matrix4>(b.structural().value("frame").get<Matrix4>()), 0, 0};
      });
  TestGraph g(registry);
  g.add("badMatrix", "bad");
  g.add("goodMatrix", "good");
  g.add("rests", "n");
  g.connect("bad.out", "n.m");
  g.connect("good.out", "n.frame");
  g.vary("bad.input");
  const Status status = g.try_pull("n.out");
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.ToString(), "node \"bad\" (badMatrix): no matrix");
}

// A binding that knows more than the declaration may bring a compute of its own; at rest, too.
TEST(BoundKernels, MayChooseTheCompute) {
  NodeRegistry registry;
  registry.add("half", "Half of its input, or as the binding chooses, twice as much.")
      .in("input", 1.0)
      .structural("twice", false)
      .out("out", Type::kDouble)
      .compute([](ComputeContext& c) { c.out_value<double>(0) = 0.5 * c.get<double>(0); })
      .bind([](const Binding& b) -> Result<BoundKernel> {
        BoundKernel kernel;
        if (b.structural().get_bool("twice"))
          kernel.compute = [](ComputeContext& c) { c.out_value<double>(0) = 2 * c.get<double>(0); };
        return kernel;
      });
  for (const bool twice : {false, true}) {
    TestGraph g(registry);
    g.add("half", "n", {{"twice", twice}});
    g.vary("n.input");
    g.want("n.out");
    EXPECT_EQ(g.compiler.Rest(g.graph, g.plug("n.out"))->AsDouble(), twice ? 2 : 0.5);
    g.set("n.input", 8.0);
    EXPECT_EQ(g.pull<double>("n.out"), twice ? 16 : 4);
  }
}

TEST_F(CompilerTest, PointsThatDoNotExist) {
  g.add("grid", "g");
  g.add("add", "a");
  g.add("source", "src");
  g.add("move", "m");
  g.hold("g.points[12].x", 1.0);
  EXPECT_EQ(g.try_pull("g.outPoints").ToString(), "g.points[12].x is set, but there are 12 points");
  ASSERT_TRUE(g.graph.Unset(g.plug("g.points[12].x")).ok());
  g.connect("a.out", "g.points[99].y");
  EXPECT_EQ(g.try_pull("g.outPoints").ToString(), "g.points[99].y is driven, but there are 12 points");
  ASSERT_TRUE(g.graph.Disconnect(g.plug("g.points[99].y")).ok());
  EXPECT_TRUE(g.try_pull("g.outPoints").ok());
  g.connect("src.outPoints", "m.points");
  g.want("m.outPoints", PointSet::Of({3}, 99));
  EXPECT_EQ(g.try_pull("g.outPoints").ToString(),
            "m.outPoints has 10 points, the request is for an array of 99");
}

TEST_F(CompilerTest, ReasonsOfWhatIsLeftOut) {
  for (const char* name : {"used", "folded", "driver", "unused"}) g.add("add", name);
  g.connect("folded.out", "used.b");
  g.connect("used.out", "unused.a");
  g.connect("driver.a", "used.a");
  g.vary("driver.a");
  g.pull<double>("used.out");
  EXPECT_EQ(Reason("folded"), "constant: depends on nothing that varies");
  EXPECT_EQ(Reason("unused"), "not needed by the request");
  EXPECT_EQ(Reason("used"), "");
  EXPECT_EQ(Reason("driver"), "");
  EXPECT_EQ(g.plan->steps().size(), 1u);
}

TEST_F(CompilerTest, AnEditRebindsOnlyWhatItChanged) {
  g.add("source", "src", {{"count", 50}});
  for (const char* name : {"p1", "p2", "p3"}) g.add("picky", name);
  g.add("move", "m");
  g.graph.Set(g.plug("src.count"), 10).ok();
  g.connect("src.outPoints", "p1.points");
  g.connect("p1.outPoints", "m.points");
  g.connect("m.outPoints", "p2.points");
  g.connect("p2.outPoints", "p3.points");
  g.vary("src.step");
  g.vary("m.offset");
  g.want("p3.outPoints");
  ASSERT_TRUE(g.compile().ok());
  EXPECT_EQ(g.compiler.stats().kernels_bound, 4u);
  EXPECT_EQ(g.compiler.stats().kernels_reused, 0u);
  const auto again = [&](Index bound, Index reused, const char* what) {
    g.plan = nullptr;
    ASSERT_TRUE(g.compile().ok());
    EXPECT_EQ(g.compiler.stats().kernels_bound, bound) << what;
    EXPECT_EQ(g.compiler.stats().kernels_reused, reused) << what;
  };
  again(0, 4, "nothing");
  g.hold("p3.factor", 5.0);
  again(1, 3, "the last kernel");
  EXPECT_FLOAT_EQ(g.pull_points("p3.outPoints")[3], 20);
  g.hold("m.offset", 1.0);  // rest values downstream change, and with them what a kernel may read of them
  again(2, 2, "a control");
  g.add("add", "elsewhere");
  again(0, 4, "another node");
  g.hold("p1.factor", 3.0);
  again(3, 1, "the first kernel, and all that may read its rest");
  g.request.outputs[0].points = PointSet::Of({2, 7}, 10);
  again(4, 0, "other points");
  g.request.outputs[0].points = PointSet();
  again(4, 0, "only the last plan's kernels are kept");
  EXPECT_FLOAT_EQ(g.pull_points("p3.outPoints")[3], 3 * 1 * 2 * 5 + 1 * 2 * 5);
}

TEST_F(CompilerTest, SharedStepsOfLazyBranchesAreHoisted) {
  // root is used on both sides of the choice, only_a and only_b on one; deep hangs in a branch of a branch
  for (const char* name : {"root", "only_a", "only_b", "deep"}) g.add("add", name, {{"b", 1.0}});
  g.add("select", "inner");
  g.add("select", "outer");
  g.connect("root.out", "only_a.a");
  g.connect("root.out", "only_b.a");
  g.connect("only_a.out", "outer.a");
  g.connect("only_b.out", "inner.a");
  g.connect("root.out", "deep.a");
  g.connect("deep.out", "inner.b");
  g.connect("inner.out", "outer.b");
  for (const char* plug : {"root.a", "inner.which", "outer.which"}) g.vary(plug);
  EXPECT_DOUBLE_EQ(g.pull<double>("outer.out"), 2);
  // Segments: the eager one, outer.a and outer.b, below the latter inner.a and inner.b, and what all share
  ASSERT_EQ(g.plan->segments().size(), 6u);
  int deepest = 0;
  for (const Plan::Segment& segment : g.plan->segments()) {
    int depth = 0;
    for (Index s = segment.parent; s != kNoIndex; s = g.plan->segments()[s].parent) ++depth;
    deepest = std::max(deepest, depth);
  }
  EXPECT_EQ(deepest, 2);
  const auto counts = [&] {
    return std::vector<std::uint64_t>{g.computes("root"), g.computes("only_a"), g.computes("only_b"),
                                      g.computes("deep"), g.computes("inner"),  g.computes("outer")};
  };
  using Counts = std::vector<std::uint64_t>;
  EXPECT_EQ(counts(), (Counts{1, 1, 0, 0, 0, 1}));
  g.set("outer.which", 1);
  EXPECT_DOUBLE_EQ(g.pull<double>("outer.out"), 2);
  EXPECT_EQ(counts(), (Counts{1, 1, 1, 0, 1, 2}));  // the same value: outer computes, since it decided anew
  g.set("inner.which", 1);
  EXPECT_DOUBLE_EQ(g.pull<double>("outer.out"), 2);
  EXPECT_EQ(counts(), (Counts{1, 1, 1, 1, 2, 2}));  // inner's output is equal: it ends there
  g.set("outer.which", 0);
  g.set("root.a", 4.0);
  EXPECT_DOUBLE_EQ(g.pull<double>("outer.out"), 6);
  EXPECT_EQ(counts(), (Counts{2, 2, 1, 1, 2, 3}));
  g.set("outer.which", 1);  // what slept catches up
  EXPECT_DOUBLE_EQ(g.pull<double>("outer.out"), 6);
  EXPECT_EQ(counts(), (Counts{2, 2, 1, 2, 3, 4}));
  g.pull<double>("outer.out");
  EXPECT_EQ(counts(), (Counts{2, 2, 1, 2, 3, 4}));
}

TEST_F(CompilerTest, LazyTogetherSharesOneDecision) {
  g.add("together", "t");
  for (int i = 0; i < 70; ++i) {  // more than there are bits
    const std::string name = "n" + std::to_string(i);
    g.add("add", name, {{"b", static_cast<double>(i)}});
    g.connect(name + ".out", "t.input[" + std::to_string(i) + "]");
    if (i % 2 == 0) g.vary(name + ".a");
  }
  g.add("add", "other", {{"b", 0.5}});
  g.connect("other.out", "t.other");
  g.vary("other.a");
  g.vary("t.wanted");
  EXPECT_DOUBLE_EQ(g.pull<double>("t.out"), 0.5);
  EXPECT_EQ(g.plan->segments().size(), 3u);
  EXPECT_EQ(g.computes("n0") + g.computes("n68"), 0u);
  g.set("t.wanted", 1);
  EXPECT_DOUBLE_EQ(g.pull<double>("t.out"), 69 * 70 / 2);
  EXPECT_EQ(g.computes("n0") + g.computes("n68"), 2u);
  EXPECT_EQ(g.computes("t"), 2u);
  g.set("n10.a", 1.0);
  EXPECT_DOUBLE_EQ(g.pull<double>("t.out"), 69 * 70 / 2 + 1);
  EXPECT_EQ(g.computes("n10"), 2u);
  EXPECT_EQ(g.computes("n12"), 1u);
  EXPECT_EQ(g.computes("other"), 1u);
}

TEST_F(CompilerTest, AChoiceOf64AndNotOneMore) {
  g.add("choice", "c");
  g.vary("c.selector");
  for (int i = 0; i < 64; ++i) {
    const std::string name = "n" + std::to_string(i);
    g.add("add", name, {{"b", static_cast<double>(i)}});
    g.connect(name + ".out", "c.input[" + std::to_string(i) + "]");
    g.vary(name + ".a");
  }
  g.want("c.out");
  for (int i : {63, 0, 31}) {
    g.set("c.selector", i);
    EXPECT_DOUBLE_EQ(g.pull<double>("c.out"), i);
    EXPECT_EQ(g.computes("n" + std::to_string(i)), 1u);
  }
  EXPECT_EQ(g.computes("n30"), 0u);
  g.hold("c.input[64]", 1.0);
  EXPECT_EQ(g.try_pull("c.out").ToString(), "node \"c\" (choice) has more than 64 lazy inputs");
}

TEST_F(CompilerTest, LazyInputsWithoutADecisionAreRefused) {
  NodeRegistry registry;
  registry.add("forgot", "")
      .in("a", 0.0)
      .in("b", 0.0)
      .lazy()
      .out("out", Type::kDouble)
      .compute([](double a, double b) { return a + b; });
  TestGraph f(registry);
  f.add("forgot", "n");
  f.vary("n.a");
  EXPECT_EQ(f.try_pull("n.out").ToString(),
            "node \"n\" (forgot) has lazy inputs but does not decide about them");
}

TEST_F(CompilerTest, VaryingElementsThatNobodySet) {
  g.add("sum", "s", {{"input[0]", 1.0}});
  g.vary("s.input[3]");
  EXPECT_DOUBLE_EQ(g.pull<double>("s.out"), 1);
  g.set("s.input[3]", 5.0);
  EXPECT_DOUBLE_EQ(g.pull<double>("s.out"), 6);
}

// A rest value evaluates all points with kernels that a plan of all points needs, too.
TEST_F(CompilerTest, WhatRestValuesBoundIsUsedAgain) {
  g.add("source", "src", {{"count", 10}});
  g.add("picky", "p1");
  g.add("move", "m");
  g.connect("src.outPoints", "p1.points");
  g.connect("p1.outPoints", "m.points");
  g.vary("src.step");
  g.want("m.outPoints");
  ASSERT_TRUE(g.compiler.Rest(g.graph, g.plug("m.outPoints")).ok());
  ASSERT_TRUE(g.compile().ok());
  EXPECT_EQ(g.compiler.stats().kernels_bound, 0u);
  EXPECT_GT(g.compiler.stats().kernels_reused, 0u);
}

TEST_F(CompilerTest, StepsAreThoseOfThePlanAndBindNothing) {
  g.add("source", "src", {{"count", 10}});
  g.add("picky", "p1");
  g.add("move", "m");
  g.add("add", "shift");
  g.add("scale3", "still", {{"factor", 2.0}});
  g.connect("shift.out", "m.offset");
  g.connect("still.out.y", "shift.b");
  g.connect("src.outPoints", "p1.points");
  g.connect("p1.outPoints", "m.points");
  g.vary("shift.a");
  g.vary("src.step");
  g.want("m.outPoints");
  const auto steps = g.compiler.Steps(g.graph, g.request);
  ASSERT_TRUE(steps.ok());
  ASSERT_TRUE(g.compile().ok());
  EXPECT_GT(g.compiler.stats().kernels_bound, 0u);
  EXPECT_EQ(g.compiler.stats().kernels_reused, 0u);
  std::map<std::string, bool> of_plan, listed;
  for (const Plan::StepInfo& info : g.plan->infos())
    of_plan[g.graph.name(info.node)] |= info.points_total > 0;
  for (const Compiler::Stepped& stepped : *steps) listed[g.graph.name(stepped.node)] = stepped.points;
  EXPECT_EQ(listed, of_plan);
  EXPECT_EQ(listed,
            (std::map<std::string, bool>{{"m", true}, {"p1", true}, {"shift", false}, {"src", true}}));
}

TEST_F(CompilerTest, TheRestStateIgnoresClips) {
  NodeRegistry registry;
  AddToyNodes(registry);
  registry.add("clip", "Time, as an animation.")
      .animation()
      .in("time", 0.0)
      .out("out", Type::kDouble)
      .compute([](double t) { return t; });
  TestGraph c(registry);
  c.add("clip", "clip", {{"time", 5.0}});
  c.add("scale3", "s", {{"input", Double3{1, 2, 3}}, {"factor", 2.0}});
  c.add("choice", "alias", {{"selector", 7}});
  c.add("add", "n");
  c.connect("clip.out", "s.input.x");
  c.connect("clip.out", "alias.selector");
  c.connect("alias.selector", "n.a");  // an int, converted on the way
  const auto rest = [&](const char* plug) {
    Result<Value> value = c.compiler.Rest(c.graph, c.plug(plug));
    EXPECT_TRUE(value.ok()) << value.status().ToString();
    return *value;
  };
  EXPECT_EQ(rest("s.out").get<Double3>(), (Double3{2, 4, 6}));
  EXPECT_EQ(rest("n.out").AsDouble(), 7);
  EXPECT_EQ(c.pull<Double3>("s.out"), (Double3{10, 4, 6}));
  EXPECT_DOUBLE_EQ(c.pull<double>("n.out"), 5);
}

TEST_F(CompilerTest, TheRestStateIgnoresPoses) {
  TestGraph c(ToyRegistry());
  c.add("scale3", "s", {{"input", Double3{1, 2, 3}}, {"factor", 2.0}});
  c.add("add", "n", {{"a", 3.0}});
  const auto rest = [&](const char* plug) { return *c.compiler.Rest(c.graph, c.plug(plug)); };
  ASSERT_TRUE(c.graph.Pose(c.plug("s.input.y"), Value(10.0)).ok());
  ASSERT_TRUE(c.graph.Pose(c.plug("n.a"), Value(5.0)).ok());
  ASSERT_TRUE(c.graph.Pose(c.plug("n.b"), Value(1.0)).ok());  // was not set
  EXPECT_EQ(c.pull<Double3>("s.out"), (Double3{2, 20, 6}));
  EXPECT_DOUBLE_EQ(c.pull<double>("n.out"), 6);
  EXPECT_EQ(rest("s.out").get<Double3>(), (Double3{2, 4, 6}));
  EXPECT_DOUBLE_EQ(rest("n.out").AsDouble(), 3);
  ASSERT_TRUE(c.graph.Pose(c.plug("n.a"), Value(7.0)).ok());  // another pose
  c.plan = nullptr;
  EXPECT_DOUBLE_EQ(c.pull<double>("n.out"), 8);
  EXPECT_DOUBLE_EQ(rest("n.out").AsDouble(), 3);
  EXPECT_FALSE(c.graph.Pose(c.plug("n.out"), Value(7.0)).ok());
}

}  // namespace
}  // namespace kpsa::engine
