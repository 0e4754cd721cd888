// Steps that run together, and steps that plans do without.
#include <gtest/gtest.h>

#include "tests/support/test_graph.h"
#include "tests/support/toy_nodes.h"

namespace kpsa::engine {
namespace {

// `count` floors of one number each, in pairs: a0 and a1 drive even and odd ones.
struct Floors {
  explicit Floors(int count) : g(ToyRegistry()) {
    for (const char* name : {"a0", "a1"}) {
      g.add("add", name);
      g.vary(std::string(name) + ".a");
    }
    for (int i = 0; i < count; ++i) {
      const std::string name = "f" + std::to_string(i);
      g.add("add", "s" + std::to_string(i), {{"b", 0.25 * i}});
      g.add("floor", name);
      g.connect("a" + std::to_string(i % 2) + ".out", "s" + std::to_string(i) + ".a");
      g.connect("s" + std::to_string(i) + ".out", name + ".input");
      g.add("add", "user" + std::to_string(i));
      g.connect(name + ".out", "user" + std::to_string(i) + ".a");
      outputs.push_back(g.want("user" + std::to_string(i) + ".out"));
    }
    EXPECT_TRUE(g.compile().ok());
    TakeBatchComputes();
  }
  std::vector<double> Values(double a0, double a1, bool record = false) {
    g.evaluator->Record(record ? g.profile.get() : nullptr);
    g.set("a0.a", a0);
    g.set("a1.a", a1);
    EXPECT_TRUE(g.evaluator->Evaluate().ok());
    std::vector<double> values;
    for (Index output : outputs) values.push_back(g.evaluator->Get<double>(output));
    return values;
  }
  TestGraph g;
  std::vector<Index> outputs;
};

TEST(Batch, StaleStepsOfAKindRunTogether) {
  Floors floors(8);
  ASSERT_EQ(floors.g.plan->batches().size(), 1u);
  EXPECT_EQ(floors.g.plan->batches()[0].count, 8u);
  EXPECT_EQ(floors.Values(0, 10), (std::vector<double>{0, 10, 0, 10, 1, 11, 1, 11}));
  EXPECT_EQ(TakeBatchComputes(), 1);
  EXPECT_EQ(floors.Values(1.5, 11.5), (std::vector<double>{1, 11, 2, 12, 2, 12, 3, 13}));
  EXPECT_EQ(TakeBatchComputes(), 1);
  // Half of them are stale: these run one by one
  EXPECT_EQ(floors.Values(2.5, 11.5), (std::vector<double>{2, 11, 3, 12, 3, 12, 4, 13}));
  EXPECT_EQ(TakeBatchComputes(), 0);
  EXPECT_EQ(floors.Values(3.5, 12.5), (std::vector<double>{3, 12, 4, 13, 4, 13, 5, 14}));
  EXPECT_EQ(TakeBatchComputes(), 1);
  floors.g.evaluator->Invalidate();
  EXPECT_EQ(floors.Values(3.5, 12.5), (std::vector<double>{3, 12, 4, 13, 4, 13, 5, 14}));
  EXPECT_EQ(TakeBatchComputes(), 1);
}

TEST(Batch, EqualOutputsStopThereAndRecordingSeesEveryStep) {
  Floors floors(8);
  floors.Values(0.5, 0.5);
  const std::vector<double> recorded = floors.Values(0.6, 0.6, true);
  EXPECT_EQ(recorded, floors.Values(0.6, 0.6));
  EXPECT_EQ(TakeBatchComputes(), 1);  // the first one only
  EXPECT_EQ(floors.g.computes("f3"), 1u);
  EXPECT_EQ(floors.g.computes("user3"), 0u);
  floors.Values(0.65, 0.65);
  EXPECT_EQ(TakeBatchComputes(), 1);
  floors.Values(0.65, 0.7, true);
  EXPECT_EQ(floors.g.computes("f3"), 2u);
  EXPECT_EQ(floors.g.computes("user3"), 0u);  // the batch left its stamp alone
}

TEST(Batch, PullsOfOneOutputRunNoMoreThanThat) {
  Floors floors(8);
  floors.Values(0, 0);
  TakeBatchComputes();
  floors.g.set("a0.a", 7.0);
  floors.g.set("a1.a", 7.0);
  ASSERT_TRUE(floors.g.evaluator->Pull(floors.outputs[2]).ok());
  EXPECT_DOUBLE_EQ(floors.g.evaluator->Get<double>(floors.outputs[2]), 7);
  EXPECT_DOUBLE_EQ(floors.g.evaluator->Get<double>(floors.outputs[4]), 1);
  EXPECT_EQ(TakeBatchComputes(), 0);
  EXPECT_EQ(floors.Values(7, 7), (std::vector<double>{7, 7, 7, 7, 8, 8, 8, 8}));
  // A run that is cut within the batch
  const Plan::Batch& batch = floors.g.plan->batches()[0];
  floors.g.set("a0.a", 9.0);
  floors.g.set("a1.a", 9.0);
  floors.g.evaluator->BeginRun();
  floors.g.evaluator->RunUntil(batch.first + 3);
  ASSERT_TRUE(floors.g.evaluator->EndRun().ok());
  EXPECT_EQ(TakeBatchComputes(), 0);
  EXPECT_EQ(floors.Values(9, 9), (std::vector<double>{9, 9, 9, 9, 10, 10, 10, 10}));
}

TEST(Batch, APullThatNeedsAllOfThemRunsThemTogether) {
  TestGraph g(ToyRegistry());
  g.add("add", "a");
  g.vary("a.a");
  std::string sum = "a.out";
  for (int i = 0; i < 6; ++i) {
    const std::string n = std::to_string(i);
    g.add("add", "s" + n, {{"b", 0.25 * i}});
    g.add("floor", "f" + n);
    g.add("add", "sum" + n);
    g.connect("a.out", "s" + n + ".a");
    g.connect("s" + n + ".out", "f" + n + ".input");
    g.connect("f" + n + ".out", "sum" + n + ".a");
    g.connect(sum, "sum" + n + ".b");
    sum = "sum" + n + ".out";
  }
  const Index some = g.want("f3.out"), all = g.want(sum);
  ASSERT_TRUE(g.compile().ok());
  ASSERT_EQ(g.plan->batches().size(), 1u);
  g.evaluator->Record(nullptr);
  TakeBatchComputes();
  ASSERT_TRUE(g.evaluator->Pull(all).ok());
  EXPECT_EQ(TakeBatchComputes(), 1);
  EXPECT_DOUBLE_EQ(g.evaluator->Get<double>(all), 0 + 0 + 0 + 0 + 1 + 1);
  g.set("a.a", 10.5);
  ASSERT_TRUE(g.evaluator->Pull(some).ok());
  EXPECT_EQ(TakeBatchComputes(), 0);
  EXPECT_DOUBLE_EQ(g.evaluator->Get<double>(some), 11);
  ASSERT_TRUE(g.evaluator->Pull(all).ok());  // what is left of them
  EXPECT_EQ(TakeBatchComputes(), 0);
  EXPECT_DOUBLE_EQ(g.evaluator->Get<double>(all), 10.5 + 10 + 10 + 11 + 11 + 11 + 11);
}

TEST(Batch, ThreadsGiveTheSame) {
  Floors floors(8);
  floors.g.evaluator = std::make_unique<Evaluator>(floors.g.plan, EvaluatorOptions{true, nullptr});
  EXPECT_EQ(floors.Values(1.5, 11.5), (std::vector<double>{1, 11, 2, 12, 2, 12, 3, 13}));
  EXPECT_EQ(TakeBatchComputes(), 1);
  EXPECT_EQ(floors.Values(2.5, 11.5), (std::vector<double>{2, 11, 3, 12, 3, 12, 4, 13}));
  EXPECT_EQ(TakeBatchComputes(), 0);
}

TEST(Batch, FewStepsMakeNone) { EXPECT_TRUE(Floors(3).g.plan->batches().empty()); }

TEST(Passed, PlansDoWithoutStepsThatHandOnTheirInput) {
  TestGraph g(ToyRegistry());
  g.add("scale3", "turned", {{"factor", 2.0}});
  g.add("scale3", "held");
  g.add("scale3", "last");
  g.connect("turned.out", "held.input");
  g.connect("held.out", "last.input");
  g.vary("turned.input");
  g.pull<Double3>("last.out");
  g.set("turned.input", Double3{1, 2, 3});
  EXPECT_EQ(g.pull<Double3>("last.out"), (Double3{2, 4, 6}));
  ASSERT_EQ(g.plan->steps().size(), 1u);
  for (const Plan::Excluded& excluded : g.plan->excluded())
    EXPECT_EQ(excluded.reason, "hands on what drives it, unchanged") << excluded.node_name;
  EXPECT_EQ(g.plan->excluded().size(), 2u);
  g.hold("held.factor", 0.5);
  g.pull<Double3>("last.out");
  g.set("turned.input", Double3{1, 2, 3});
  EXPECT_EQ(g.pull<Double3>("last.out"), (Double3{1, 2, 3}));
  EXPECT_EQ(g.plan->steps().size(), 2u);
}

TEST(Passed, NotWhereWhatHoldsItMayVary) {
  TestGraph g(ToyRegistry());
  g.add("add", "factor", {{"b", 1.0}});
  g.add("scale3", "driven");
  g.add("scale3", "free");
  g.connect("factor.out", "driven.factor");
  g.connect("driven.out", "free.input");
  for (const char* plug : {"factor.a", "driven.input", "free.factor"}) g.vary(plug);
  g.pull<Double3>("free.out");
  g.set("driven.input", Double3{1, 2, 3});
  EXPECT_EQ(g.pull<Double3>("free.out"), (Double3{1, 2, 3}));
  EXPECT_EQ(g.plan->steps().size(), 3u);
  g.set("factor.a", 1.0);
  g.set("free.factor", 3.0);
  EXPECT_EQ(g.pull<Double3>("free.out"), (Double3{6, 12, 18}));
}

TEST(Passed, AVaryingInputIsTheOutput) {
  TestGraph g(ToyRegistry());
  g.add("scale3", "only");
  g.vary("only.input");
  g.pull<Double3>("only.out");
  g.set("only.input", Double3{-0.0, 5, 7});
  EXPECT_EQ(g.pull<Double3>("only.out"), (Double3{0, 5, 7}));
  EXPECT_TRUE(g.plan->steps().empty());
  g.set("only.input", Double3{1, 1, 1});
  EXPECT_EQ(g.pull<Double3>("only.out"), (Double3{1, 1, 1}));
}

}  // namespace
}  // namespace kpsa::engine
