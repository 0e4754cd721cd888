// Steps whose node touches none of the points that are asked for are left out.
#include <gtest/gtest.h>

#include "graph/compiler.h"
#include "tests/support/test_graph.h"
#include "tests/support/toy_nodes.h"

namespace kpsa::engine {
namespace {

// source > move > raise, which touches the points from 5 on.
class Untouched : public testing::Test {
 protected:
  Untouched() : g(ToyRegistry()) {
    for (const char* name : {"along", "up"}) g.add("add", name);
    g.add("source", "src");
    g.add("move", "m");
    g.add("raise", "r", {{"first", std::int64_t{5}}});
    g.connect("src.outPoints", "m.points");
    g.connect("along.out", "m.offset");
    g.connect("m.outPoints", "r.points");
    g.connect("up.out", "r.by");
    for (const char* plug : {"along.a", "up.a"}) {
      g.vary(plug);
    }
  }
  std::string Reason(const std::string& node) {
    for (const Plan::Excluded& e : g.plan->excluded()) {
      if (e.node_name == node) return e.reason;
    }
    return "";
  }
  void Set() {
    g.set("along.a", 0.5);
    if (g.evaluator->FindVarying(g.graph, g.plug("up.a")).ok()) g.set("up.a", 2.0);
  }
  TestGraph g;
};

TEST_F(Untouched, ANodeThatTouchesNoneOfThePointsDoesNotRun) {
  const Index few = g.want("r.outPoints", PointSet::Of({1, 3}, 10));
  ASSERT_TRUE(g.compile().ok());
  EXPECT_EQ(Reason("r"), "moves none of the points of the request");

  Set();
  ASSERT_TRUE(g.evaluator->Evaluate().ok());
  const ConstPointsView points = g.evaluator->Points(few);
  ASSERT_EQ(points.count, 2u);
  EXPECT_EQ(points.x[0], 1.5f);
  EXPECT_EQ(points.x[1], 3.5f);
  EXPECT_EQ(points.y[1], 0);
  EXPECT_EQ(g.computes("r"), 0u);
  EXPECT_EQ(g.computes("up"), 0u);
}

TEST_F(Untouched, OneTouchedPointIsEnoughToRun) {
  const Index few = g.want("r.outPoints", PointSet::Of({1, 7}, 10));
  ASSERT_TRUE(g.compile().ok());
  Set();
  ASSERT_TRUE(g.evaluator->Evaluate().ok());
  EXPECT_EQ(g.evaluator->Points(few).y[0], 0);
  EXPECT_EQ(g.evaluator->Points(few).y[1], 2);
  EXPECT_EQ(g.computes("r"), 1u);
}

// Of two readers one passes the node by; what a neighbourhood demands counts, not what is asked for.
TEST_F(Untouched, EveryReaderIsLookedAtByItself) {
  g.add("smooth", "s");
  g.connect("r.outPoints", "s.points");
  g.request.outputs = {{g.plug("r.outPoints"), PointSet::Of({2}, 10)},
                       {g.plug("s.outPoints"), PointSet::Of({0}, 10)}};
  g.names = {"few", "ring"};
  ASSERT_TRUE(g.compile().ok());
  Set();
  ASSERT_TRUE(g.evaluator->Evaluate().ok());
  EXPECT_EQ(g.computes("r"), 1u);  // for point 9, beside point 0 on the ring
  EXPECT_EQ(g.evaluator->Points(0).x[0], 2.5f);
  EXPECT_FLOAT_EQ(g.evaluator->Points(1).x[0], (9.5f + 0.5f + 1.5f) / 3);
}

// What would move all points by nothing does not run, as long as that is so for ever.
TEST_F(Untouched, AStrengthThatRestsAtZeroLeavesTheNodeOut) {
  g.request.varying.pop_back();  // up.a
  const Index all = g.want("r.outPoints");
  ASSERT_TRUE(g.compile().ok());
  EXPECT_EQ(Reason("r"), "moves none of the points of the request");
  Set();
  ASSERT_TRUE(g.evaluator->Evaluate().ok());
  EXPECT_EQ(g.computes("r"), 0u);
  EXPECT_EQ(g.evaluator->Points(all).x[7], 7.5f);
  EXPECT_EQ(g.evaluator->Points(all).y[7], 0);

  ASSERT_TRUE(g.graph.Set(g.plug("up.a"), Value(2.0)).ok());
  g.plan = nullptr;
  ASSERT_TRUE(g.compile().ok());
  Set();
  ASSERT_TRUE(g.evaluator->Evaluate().ok());
  EXPECT_EQ(g.computes("r"), 1u);
  EXPECT_EQ(g.evaluator->Points(all).y[7], 2);
}

TEST_F(Untouched, TheBitsAreThoseOfAllPoints) {
  const Index all = g.want("r.outPoints");
  ASSERT_TRUE(g.compile().ok());
  Set();
  ASSERT_TRUE(g.evaluator->Evaluate().ok());
  const std::vector<float> x(g.evaluator->Points(all).x, g.evaluator->Points(all).x + 10);
  for (Index point = 0; point < 10; ++point) {
    Request one{{{g.plug("r.outPoints"), PointSet::Of({point}, 10)}}, g.request.varying};
    const auto plan = g.compiler.Compile(g.graph, one);
    ASSERT_TRUE(plan.ok());
    Evaluator evaluator(*plan);
    evaluator.Set((*plan)->FindVarying(g.plug("along.a")), 0.5);
    ASSERT_TRUE(evaluator.Evaluate().ok());
    EXPECT_EQ(evaluator.Points(0).x[0], x[point]);
    EXPECT_EQ(evaluator.plan().steps().size(), point < 5 ? 2u : 4u) << point;
  }
}

int asked_what_it_touches = 0;

// Deformers may look at all of their points for it, so they are asked once for the same points, as long as nothing that
// they may look at changes; what a compilation has not needed is forgotten.
TEST(UntouchedAgain, ADeformerIsAskedOnceForTheSamePoints) {
  NodeRegistry registry;
  AddToyNodes(registry);
  registry.add("ask", "Leaves the points as they are, and touches those from the first on.")
      .structural("first", 0)
      .points_in("points")
      .in("by", 0.0)
      .out("outPoints", Type::kPoints)
      .compute([](ComputeContext& c) { CopyPoints(c.points(0), c.out_points(0)); })
      .bind([](const Binding&) {
        return Result<BoundKernel>(BoundKernel{std::make_shared<int>(0), 0, 0});
      })
      .in_place("points")
      .touches("points", [](const Structural& structural, const PointSet& points) {
        ++asked_what_it_touches;
        return points.Contains(static_cast<Index>(structural.get_int("first")));
      });
  TestGraph g(registry);
  g.add("add", "up");
  g.add("source", "src");
  g.add("ask", "d", {{"first", std::int64_t{5}}});
  g.connect("src.outPoints", "d.points");
  g.connect("up.out", "d.by");
  g.vary("up.a");
  const auto steps_of = [&](Index point) {
    const Request request{{{g.plug("d.outPoints"), PointSet::Of({point}, 10)}}, g.request.varying};
    const auto plan = g.compiler.Compile(g.graph, request);
    return plan.ok() ? (*plan)->steps().size() : 100;
  };
  const auto expect = [&](Index point, std::size_t steps, int times, const char* what) {
    asked_what_it_touches = 0;
    EXPECT_EQ(steps_of(point), steps) << what;
    EXPECT_EQ(asked_what_it_touches, times) << what;
  };
  expect(3, 0, 1, "first");
  expect(3, 0, 0, "again");
  expect(5, 2, 1, "another point");
  expect(5, 2, 0, "that again");
  ASSERT_TRUE(g.graph.Set(g.plug("d.first"), Value(std::int64_t{3})).ok());
  expect(3, 2, 1, "what it looks at has changed");
  ASSERT_TRUE(g.graph.Set(g.plug("d.first"), Value(std::int64_t{5})).ok());
  expect(5, 2, 1, "forgotten");
  const Request request{{{g.plug("d.outPoints"), PointSet::Of({4}, 10)}}, g.request.varying};
  asked_what_it_touches = 0;
  ASSERT_TRUE(g.compiler.SurveyOf(g.graph, request, {}).ok());
  EXPECT_EQ(asked_what_it_touches, 1);
  expect(4, 0, 0, "a survey asked that");
  expect(5, 2, 1, "forgotten again");
}

}  // namespace
}  // namespace kpsa::engine
