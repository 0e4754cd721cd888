#include "graph/explain.h"

#include <gtest/gtest.h>

#include "graph/plan_report.h"
#include "tests/support/test_graph.h"
#include "tests/support/toy_nodes.h"

namespace kpsa::engine {
namespace {

class ExplainTest : public ::testing::Test {
 protected:
  // src > stretch > far (all points, asked for) and near (three points, lazily, if which is set)
  void SetUp() override {
    g.add("source", "src");
    g.add("smooth", "ring");
    g.add("move", "shift");
    g.add("measure", "far");
    g.add("select", "pick");
    g.add("measure", "near");
    g.connect("src.outPoints", "ring.points");
    g.connect("ring.outPoints", "shift.points");
    g.connect("src.outPoints", "far.points");
    g.connect("shift.outPoints", "near.points");
    g.connect("far.out", "pick.a");
    g.connect("near.out", "pick.b");
    g.vary("src.step");
    g.vary("shift.offset");
    g.vary("pick.which");
    g.want("pick.out");
    g.want("shift.outPoints", PointSet::Of({4}, 10));
    ASSERT_TRUE(g.compile().ok());
  }
  Index Step(const std::string& name, Index segment_not = kNoIndex) const {
    for (Index s = 0; s < g.plan->steps().size(); ++s) {
      if (name == g.plan->step_name(s) && *g.plan->step_label(s) == 0 &&
          g.plan->infos()[s].segment != segment_not)
        return s;
    }
    ADD_FAILURE() << "no step of " << name;
    return 0;
  }
  TestGraph g{ToyRegistry()};
};

TEST_F(ExplainTest, WhatDirtiedAStep) {
  ASSERT_TRUE(g.evaluator->Evaluate().ok());
  g.set("src.step", 2.0);
  ASSERT_TRUE(g.evaluator->Evaluate().ok());
  EXPECT_EQ(CauseChain(*g.plan, *g.profile, Step("pick")), "src.step > src > far > pick");
  g.set("shift.offset", 2.0);
  ASSERT_TRUE(g.evaluator->Evaluate().ok());
  EXPECT_EQ(CauseChain(*g.plan, *g.profile, Step("shift")), "shift.offset > shift");
  EXPECT_EQ(CauseChain(*g.plan, *g.profile, Step("pick")), "src.step > src > far > pick");
}

TEST_F(ExplainTest, WhoNeedsAStepAndItsPoints) {
  const Plan& plan = *g.plan;
  EXPECT_EQ(NeedChain(plan, Step("far")), "pick (no points) > the request");
  EXPECT_EQ(NeedChain(plan, Step("near")), "pick (no points) > the request");
  EXPECT_EQ(NeedChain(plan, Step("pick")), "the request");
  EXPECT_EQ(MaskText(plan, Step("shift", 1)), "the request asks for 1 of 10 points");
  EXPECT_EQ(MaskText(plan, Step("ring", 1)), "shift reads the same points");
  EXPECT_EQ(MaskText(plan, Step("pick")), "it has no points to leave out");
  EXPECT_EQ(PointsText(plan.infos()[Step("shift", 1)]), "1 of 10 points");
  EXPECT_EQ(NeededBy(plan, Step("pick")), "the request");
  EXPECT_EQ(SegmentName(plan, 0), "always");
  EXPECT_EQ(SegmentName(plan, plan.infos()[Step("near")].segment), "only if pick asks for it");
}

TEST_F(ExplainTest, TimesOfNodesAndTheCriticalPath) {
  const Plan& plan = *g.plan;
  Profile profile(plan);
  double sum = 0;
  for (Index s = 0; s < plan.steps().size(); ++s) {
    const std::uint64_t ns = std::string(plan.step_name(s)) == "near" ? 500 : 10;
    profile.Add({s, kNoIndex, 0, ns, 0, 0});
    sum += static_cast<double>(ns);
  }
  const std::vector<NodeTime> nodes = NodeTimes(plan, profile);
  EXPECT_EQ(nodes.front().name, "near");
  double self = 0;
  for (const NodeTime& node : nodes) {
    self += node.self_ns;
    EXPECT_GE(node.inclusive_ns, node.self_ns);
    if (node.name == "src") {
      EXPECT_EQ(node.inclusive_ns, node.self_ns);
    }
  }
  EXPECT_EQ(self, sum);
  const CriticalPath path = FindCriticalPath(plan, profile);
  ASSERT_GE(path.steps.size(), 4u);
  EXPECT_STREQ(plan.step_name(path.steps.front()), "src");
  EXPECT_STREQ(plan.step_name(path.steps.back()), "pick");
  EXPECT_EQ(path.ns, static_cast<double>(500 + 10 * (path.steps.size() - 1)));
}

}  // namespace
}  // namespace kpsa::engine
