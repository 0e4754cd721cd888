// Several lazy inputs of one owner: what only they share runs once, before the chosen ones, and not at all
// where none is chosen. Every graph has a twin whose owners read everything eagerly, and equals it bit for
// bit.
#include <gtest/gtest.h>

#include <cstring>
#include <random>
#include <set>

#include "base/parallel.h"
#include "graph/frames.h"
#include "graph/plan_report.h"
#include "tests/graph/lazy_toys.h"
#include "tests/support/test_graph.h"
#include "tests/support/toy_nodes.h"

namespace kpsa::engine {
namespace {

// Deformers over points, read by 50 patches and whole; `world` and what leads to it are all that they share,
// among it points (probe measures them), and an owner of its own (side).
constexpr int kPatches = 50;
constexpr std::int64_t kAllOfThem = std::int64_t{1} << kPatches;

void BuildPatches(TestGraph& g) {
  g.add("add", "time");
  g.vary("time.a");
  g.add("source", "src", {{"count", std::int64_t{kPatchPoints}}, {"step", 0.37}});
  g.add("move", "before");
  g.add("measure", "probe");
  for (const char* name : {"root", "left", "right", "world", "seen"}) g.add("add", name, {{"b", 0.21}});
  g.add("pick", "side");
  g.add("smooth", "ring", {{"rings", 2}});
  g.add("move", "after");
  g.add("raise", "up", {{"first", 60}});
  g.add("patches", "p");
  g.connect("time.out", "before.offset");
  g.connect("time.out", "seen.a");
  g.connect("src.outPoints", "before.points");
  g.connect("before.outPoints", "probe.points");
  g.connect("time.out", "root.a");
  g.connect("root.out", "left.a");
  g.connect("root.out", "right.a");
  g.connect("left.out", "side.input[0]");
  g.connect("right.out", "side.input[1]");
  g.connect("probe.out", "world.a");
  g.connect("side.out", "world.b");
  g.connect("before.outPoints", "ring.points");
  g.connect("ring.outPoints", "after.points");
  g.connect("world.out", "after.offset");
  g.connect("after.outPoints", "up.points");
  g.connect("world.out", "up.by");
  for (int e = 0; e < kPatches; ++e) g.connect("up.outPoints", "p.patch[" + std::to_string(e) + "]");
  g.connect("up.outPoints", "p.all[0]");
  for (const char* plug : {"p.chosen", "side.chosen"}) g.vary(plug);
  g.want("p.outPoints");
  g.want("seen.out");
  ASSERT_TRUE(g.compile().ok());
}

class SharedLazyTest : public testing::Test {
 protected:
  SharedLazyTest() : g(LazyToys(true)), eager(LazyToys(false)) {
    BuildPatches(g);
    BuildPatches(eager);
  }
  static void Set(Evaluator& e, double time, std::int64_t chosen, std::int64_t side) {
    e.Set(0, time);
    e.SetInt(1, chosen);
    e.SetInt(2, side);
  }
  // Sets both, evaluates both, and compares them.
  void Check(double time, std::int64_t chosen, std::int64_t side = 1) {
    Set(*g.evaluator, time, chosen, side);
    Set(*eager.evaluator, time, chosen, side);
    ASSERT_TRUE(g.evaluator->Evaluate().ok());
    ASSERT_TRUE(eager.evaluator->Evaluate().ok());
    EXPECT_EQ(OutputBytes(*g.evaluator), OutputBytes(*eager.evaluator)) << chosen << " at " << time;
  }
  Index Step(const char* name) const {
    for (Index s = 0; s < g.plan->steps().size(); ++s) {
      if (std::string(name) == g.plan->step_name(s)) return s;
    }
    return kNoIndex;
  }
  Index SegmentOf(const char* name) const { return g.plan->infos()[Step(name)].segment; }
  const Plan::Branch& BranchOf(const char* name) const {
    return g.plan->branches()[g.plan->steps()[Step(name)].branch];
  }

  TestGraph g, eager;
};

TEST_F(SharedLazyTest, WhatLazyInputsShareHasASegmentBetween) {
  const Plan& plan = *g.plan;
  const Index shared = SegmentOf("world");
  EXPECT_EQ(plan.segments()[shared].parent, 0u);
  EXPECT_EQ(plan.segments()[shared].owner, Step("p"));
  EXPECT_TRUE(plan.segments()[shared].uses_workspace);  // what probe measures
  EXPECT_EQ(SegmentName(plan, shared), "only if p asks for it");
  for (const char* name : {"world", "side", "probe"}) EXPECT_EQ(SegmentOf(name), shared) << name;
  for (const char* name : {"time", "seen", "p"}) EXPECT_EQ(SegmentOf(name), 0u) << name;
  std::set<Index> lazy;
  for (const Index g_of : BranchOf("p").segment_of_lazy) {
    lazy.insert(g_of);
    EXPECT_EQ(plan.segments()[g_of].parent, 0u);
    EXPECT_EQ(plan.segments()[g_of].needs, std::vector<Index>{shared});
  }
  EXPECT_EQ(std::set<Index>(plan.segments()[shared].users.begin(), plan.segments()[shared].users.end()),
            lazy);
  EXPECT_EQ(lazy.size(), kPatches + 1u);
  // An owner that is itself shared, and what its lazy inputs share
  const Index inner = SegmentOf("root");
  EXPECT_EQ(plan.segments()[inner].users.size(), 2u);
  EXPECT_EQ(plan.segments()[inner].parent, shared);
  EXPECT_EQ(SegmentName(plan, inner), "only if side asks for it");
  // Points are the segments' own, a step each
  int after = 0;
  for (Index s = 0; s < plan.steps().size(); ++s) {
    if (plan.step_name(s) != std::string("after")) continue;
    ++after;
    EXPECT_TRUE(lazy.count(plan.infos()[s].segment) == 1);
    EXPECT_TRUE(plan.infos()[s].points == kPatchPoints || plan.infos()[s].points < 8);
  }
  EXPECT_EQ(after, kPatches + 1);
  EXPECT_EQ(SharedSegments(*eager.plan), 0);
}

TEST_F(SharedLazyTest, OneLazyInputOrNothingSharedMakesNoSegment) {
  TestGraph one(LazyToys(true));
  for (const char* name : {"root", "left", "right", "mine", "other"}) one.add("add", name);
  one.add("pick", "pick");
  one.connect("root.out", "left.a");
  one.connect("root.out", "left.b");
  one.connect("left.out", "pick.input[0]");
  one.vary("root.a");
  one.vary("pick.chosen");
  one.vary("mine.a");
  one.hold("pick.input[1]", 4.0);  // needs no step
  one.pull<double>("pick.out");
  EXPECT_EQ(one.plan->segments().size(), 2u);
  EXPECT_EQ(SharedSegments(*one.plan), 0);
  one.connect("mine.out", "other.a");
  one.connect("other.out", "pick.input[2]");
  one.pull<double>("pick.out");
  EXPECT_EQ(one.plan->segments().size(), 3u);
  EXPECT_EQ(SharedSegments(*one.plan), 0);
  EXPECT_EQ(one.plan->segments()[2].parent, 0u);
  one.connect("root.out", "other.b");
  one.pull<double>("pick.out");
  EXPECT_EQ(one.plan->segments().size(), 4u);
  EXPECT_EQ(SharedSegments(*one.plan), 1);
  one.want("root.out");  // it is needed in any case
  one.pull<double>("pick.out");
  EXPECT_EQ(one.plan->segments().size(), 3u);
  EXPECT_EQ(SharedSegments(*one.plan), 0);
}

TEST_F(SharedLazyTest, RunsOnceIfAnyIsChosenAndNotIfNoneIs) {
  using Counts = std::vector<std::uint64_t>;
  const auto counts = [&] {
    return Counts{g.computes("world"), g.computes("probe"), g.computes("root"), g.computes("left"),
                  g.computes("after")};
  };
  Check(1, 0);
  Check(2, 0);
  EXPECT_EQ(counts(), (Counts{0, 0, 0, 0, 0}));
  EXPECT_EQ(g.computes("seen"), 2u);
  Check(2, 5);
  EXPECT_EQ(counts(), (Counts{1, 1, 1, 1, 2}));
  Check(2, 4);  // no longer the first
  EXPECT_EQ(counts(), (Counts{1, 1, 1, 1, 2}));
  Check(2, 12);  // one more
  EXPECT_EQ(counts(), (Counts{1, 1, 1, 1, 3}));
  Check(3, 1);
  EXPECT_EQ(counts(), (Counts{2, 2, 2, 2, 4}));
  Check(4, 0);
  EXPECT_EQ(counts(), (Counts{2, 2, 2, 2, 4}));
  Check(5, 2);
  EXPECT_EQ(counts(), (Counts{3, 3, 3, 3, 5}));
  Check(5, 2, 0);  // nothing of side
  EXPECT_EQ(counts(), (Counts{4, 3, 3, 3, 6}));
  Check(6, 2, 0);
  EXPECT_EQ(counts(), (Counts{5, 4, 3, 3, 7}));
  Check(6, 2, 2);  // the other one, with what it shares with the first
  EXPECT_EQ(counts(), (Counts{6, 4, 4, 3, 8}));
  Check(6, kAllOfThem, 2);
  EXPECT_EQ(counts(), (Counts{6, 4, 4, 3, 9}));
}

TEST_F(SharedLazyTest, AChangeThatReachesOnlyWhatIsSharedReachesTheOwner) {
  // world's value stays what it was, and what reads it does not compute
  Check(1, 3, 0);
  const std::uint64_t world = g.computes("world"), after = g.computes("after"), owner = g.computes("p");
  Check(1, 3, 4);  // side has no third input
  EXPECT_EQ(g.computes("world"), world);
  EXPECT_EQ(g.computes("after"), after);
  EXPECT_EQ(g.computes("p"), owner);
  Check(1, 3, 3);
  EXPECT_EQ(g.computes("world"), world + 1);
  EXPECT_EQ(g.computes("after"), after + 2);
  EXPECT_EQ(g.computes("p"), owner + 1);
}

TEST_F(SharedLazyTest, EachPatchAndCombinationsHaveTheFullPointsBitForBit) {
  std::mt19937 random(7);
  TestGraph whole(LazyToys(true));
  BuildPatches(whole);
  whole.want("up.outPoints");
  ASSERT_TRUE(whole.compile().ok());
  const auto check = [&](double time, std::int64_t chosen) {
    Check(time, chosen);
    Set(*whole.evaluator, time, 0, 1);
    ASSERT_TRUE(whole.evaluator->Evaluate().ok());
    const ConstPointsView expected = whole.evaluator->Points(2), got = g.evaluator->Points(0);
    ASSERT_EQ(got.count, kPatchPoints);
    for (Index i = 0; i < kPatchPoints; ++i) {
      if ((chosen >> i % kPatches & 1) == 0 && chosen < kAllOfThem) continue;
      EXPECT_EQ(std::memcmp(got.x + i, expected.x + i, sizeof(float)), 0) << i << " " << chosen;
      EXPECT_EQ(std::memcmp(got.y + i, expected.y + i, sizeof(float)), 0) << i << " " << chosen;
      EXPECT_EQ(std::memcmp(got.z + i, expected.z + i, sizeof(float)), 0) << i << " " << chosen;
    }
  };
  for (int e = 0; e <= kPatches; ++e) check(0.3 * e, std::int64_t{1} << e);
  for (int i = 0; i < 100; ++i) {
    const std::int64_t some = static_cast<std::int64_t>(random()) << 24 ^ static_cast<std::int64_t>(random());
    check(0.01 * static_cast<double>(random() % 300), some % (2 * kAllOfThem));
  }
  check(-1, kAllOfThem - 1);
  check(-2, 2 * kAllOfThem - 1);
}

// Frames in an order, on several threads, and by pulls: the eager twin's bytes.
TEST_F(SharedLazyTest, SameBytesForAnyThreadsBlocksAndOrder) {
  constexpr std::size_t kSharedFrames = 61;
  const auto set = [](std::size_t frame, Evaluator& e) {
    const auto f = static_cast<std::int64_t>(frame);
    const std::int64_t one = std::int64_t{1} << (f * 7 % kPatches);
    const std::int64_t chosen = f % 4 == 0   ? 0
                                : f % 7 == 3 ? kAllOfThem
                                : f % 5 == 1 ? one | 0x30f0f0f0f0f
                                             : one;
    Set(e, static_cast<double>(f % 3) / 8, chosen, f / 2 % 4);
  };
  std::vector<std::string> expected;
  for (std::size_t frame = 0; frame < kSharedFrames; ++frame) {
    Evaluator fresh(eager.plan);
    set(frame, fresh);
    ASSERT_TRUE(fresh.Evaluate().ok());
    expected.push_back(OutputBytes(fresh));
  }
  EXPECT_GT(std::set<std::string>(expected.begin(), expected.end()).size(), 30u);
  for (const int threads : {1, 2, 4}) {
    for (const int block : {1, 3, 8}) {
      for (const std::size_t stride : {1, 25}) {
        std::vector<std::string> got(kSharedFrames);
        FrameOptions options;
        options.threads = threads;
        options.block = block;
        const Status status = EvaluateFrames(
            g.plan, kSharedFrames, options,
            [&](std::size_t i, Evaluator& e) { set(i * stride % kSharedFrames, e); },
            [&](std::size_t i, const Evaluator& e, const Status& evaluated) {
              got[i * stride % kSharedFrames] = OutputBytes(e);
              return evaluated;
            });
        ASSERT_TRUE(status.ok()) << status.ToString();
        EXPECT_EQ(got, expected) << threads << " threads, blocks of " << block << ", stride " << stride;
      }
    }
    ThreadLimit limit(threads);
    Evaluator parallel(g.plan, EvaluatorOptions{true, nullptr});
    Workspace workspace(*g.plan);
    Evaluator a(g.plan, {false, &workspace}),
        b(g.plan, {false, &workspace});  // each loses what the other takes
    for (std::size_t i = 0; i < 2 * kSharedFrames; ++i) {
      const std::size_t frame = i * 25 % kSharedFrames;
      for (Evaluator* e : {&parallel, i % 3 == 0 ? &a : &b}) {
        set(frame, *e);
        if (i % 2 == 0) {
          ASSERT_TRUE(e->Pull(0).ok());
        }
        ASSERT_TRUE(e->Evaluate().ok());
        EXPECT_EQ(OutputBytes(*e), expected[frame]) << frame;
      }
    }
  }
}

TEST_F(SharedLazyTest, AFailureInWhatIsSharedIsTheOwners) {
  for (const bool parallel : {false, true}) {
    TestGraph f(LazyToys(true));
    f.options.parallel = parallel;
    f.add("fail", "gate");
    for (const char* name : {"left", "right"}) {
      f.add("add", name);
      f.connect("gate.out", name + std::string(".a"));
    }
    f.add("pick", "pick");
    f.connect("left.out", "pick.input[0]");
    f.connect("right.out", "pick.input[1]");
    f.vary("gate.input");
    f.vary("pick.chosen");
    f.want("pick.out");
    f.set("gate.input", -1.0);
    EXPECT_DOUBLE_EQ(f.pull<double>("pick.out"), 0);
    f.set("pick.chosen", 2);
    for (int again = 0; again < 2; ++again)
      EXPECT_EQ(f.try_pull("pick.out").ToString(), "node \"gate\" (fail): input is below zero");
    f.set("pick.chosen", 0);
    EXPECT_DOUBLE_EQ(f.pull<double>("pick.out"), 0);
    f.set("pick.chosen", 3);
    f.set("gate.input", 2.0);
    EXPECT_DOUBLE_EQ(f.pull<double>("pick.out"), 4);
    EXPECT_EQ(f.computes("left") + f.computes("right"), 2u);
  }
}

// A value that lazy inputs of several owners read, or some of one owner's: it runs once, when the first of them is
// chosen, and where none is its failure is nobody's.
TEST_F(SharedLazyTest, WhatSeveralOwnersShareRunsWhenTheFirstIsChosen) {
  for (const bool parallel : {false, true}) {
    TestGraph f(LazyToys(true));
    f.options.parallel = parallel;
    f.add("fail", "gate");
    f.add("add", "after");
    f.add("add", "time");
    f.connect("gate.out", "after.a");
    for (const char* name : {"one", "two", "three"}) {
      f.add("pick", name);
      f.connect("after.out", name + std::string(".input[0]"));
      f.connect("time.out", name + std::string(".input[1]"));
      f.vary(name + std::string(".chosen"));
    }
    f.connect("after.out", "three.input[2]");
    f.add("add", "sum");
    f.connect("one.out", "sum.a");
    f.connect("two.out", "sum.b");
    f.vary("gate.input");
    f.vary("time.a");
    f.want("sum.out");
    f.want("three.out");
    f.set("gate.input", -1.0);
    f.set("time.a", 3.0);
    const auto choose = [&](std::int64_t one, std::int64_t two, std::int64_t three) {
      f.set("one.chosen", one);
      f.set("two.chosen", two);
      f.set("three.chosen", three);
    };
    choose(2, 2, 2);
    EXPECT_DOUBLE_EQ(f.pull<double>("sum.out"), 6);
    EXPECT_DOUBLE_EQ(f.pull<double>("three.out"), 3);
    EXPECT_EQ(f.computes("gate") + f.computes("after"), 0u);
    for (const int who : {0, 1, 2}) {
      choose(who == 0 ? 1 : 2, who == 1 ? 1 : 2, who == 2 ? 4 : 2);
      EXPECT_EQ(f.try_pull(who == 2 ? "three.out" : "sum.out").ToString(),
                "node \"gate\" (fail): input is below zero")
          << who;
      choose(0, 0, 0);
      EXPECT_DOUBLE_EQ(f.pull<double>("sum.out"), 0) << "it heals";
      EXPECT_DOUBLE_EQ(f.pull<double>("three.out"), 0);
    }
    const std::uint64_t before = f.computes("after");
    f.set("gate.input", 5.0);
    choose(1, 2, 0);
    EXPECT_DOUBLE_EQ(f.pull<double>("sum.out"), 8);
    choose(1, 1, 5);
    EXPECT_DOUBLE_EQ(f.pull<double>("sum.out"), 10);
    EXPECT_DOUBLE_EQ(f.pull<double>("three.out"), 10);
    EXPECT_EQ(f.computes("after"), before + 1);
    EXPECT_EQ(f.plan->segments().size(), 1u + 7 + 2);
    EXPECT_EQ(SharedSegments(*f.plan), 2);  // after with gate, and time
  }
}

// Two sides of one owner share what fails; the third is chosen.
TEST_F(SharedLazyTest, WhatTheOtherSidesShareDoesNotRun) {
  TestGraph f(LazyToys(true));
  f.add("fail", "gate");
  f.add("pick", "pick");
  for (const char* name : {"left", "right", "mine"}) f.add("add", name);
  f.connect("gate.out", "left.a");
  f.connect("gate.out", "right.a");
  for (int e = 0; const char* name : {"left", "right", "mine"})
    f.connect(name + std::string(".out"), "pick.input[" + std::to_string(e++) + "]");
  for (const char* plug : {"gate.input", "mine.a", "pick.chosen"}) f.vary(plug);
  f.want("pick.out");
  f.set("gate.input", -1.0);
  f.set("mine.a", 7.0);
  f.set("pick.chosen", 4);
  EXPECT_DOUBLE_EQ(f.pull<double>("pick.out"), 7);
  EXPECT_EQ(f.computes("gate"), 0u);
  EXPECT_EQ(SegmentName(*f.plan, 4), "only if pick asks for it");
}

// An array without elements, and one that a demand skips, keep the bits of what comes after them.
TEST_F(SharedLazyTest, ArraysWithoutElementsKeepTheirBit) {
  NodeRegistry registry;
  AddToyNodes(registry);
  registry.add("both", "One or the other.")
      .in("chosen", 0)
      .in("none", 0.0)
      .array()
      .lazy(true)
      .in("all", 0.0)
      .array()
      .lazy(true)
      .in("one", 0.0)
      .lazy()
      .out("out", Type::kDouble)
      .compute([](std::int64_t chosen, ArrayView<double> none, ArrayView<double> all, double one) {
        double sum = (chosen & 4) != 0 ? one : 0;
        for (std::uint32_t i = 0; i < none.size(); ++i) sum += (chosen & 1) != 0 ? none[i] : 0;
        for (std::uint32_t i = 0; i < all.size(); ++i) sum += (chosen & 2) != 0 ? all[i] : 0;
        return sum;
      })
      .decide([](ComputeContext& c) -> std::uint64_t {
        return static_cast<std::uint64_t>(c.get<std::int64_t>(0));
      });
  for (const int elements : {0, 1, 3}) {
    TestGraph f(registry);
    for (const char* name : {"time", "sum"}) f.add("add", name);
    f.add("both", "both");
    f.connect("time.out", "sum.a");
    for (int e = 0; e < elements; ++e) f.connect("time.out", "both.all[" + std::to_string(e) + "]");
    f.connect("sum.out", "both.one");
    f.vary("time.a");
    f.vary("both.chosen");
    f.want("both.out");
    for (const double time : {1.0, 2.0}) {
      f.set("time.a", time);
      f.set("both.chosen", 4);
      EXPECT_DOUBLE_EQ(f.pull<double>("both.out"), time) << elements;
      f.set("both.chosen", 2);
      EXPECT_DOUBLE_EQ(f.pull<double>("both.out"), elements * time);
      f.set("both.chosen", 7);
      EXPECT_DOUBLE_EQ(f.pull<double>("both.out"), (elements + 1) * time);
    }
  }
}

TEST_F(SharedLazyTest, All64BitsAndDeepNests) {
  TestGraph wide(LazyToys(true));
  wide.add("add", "root");
  wide.add("pick", "pick");
  wide.vary("root.a");
  wide.vary("pick.chosen");
  for (int i = 0; i < 64; ++i) {
    const std::string name = "n" + std::to_string(i);
    wide.add("add", name, {{"b", static_cast<double>(i)}});
    wide.connect("root.out", name + ".a");
    wide.connect(name + ".out", "pick.input[" + std::to_string(i) + "]");
  }
  wide.want("pick.out");
  wide.set("root.a", 0.5);
  EXPECT_DOUBLE_EQ(wide.pull<double>("pick.out"), 0);
  EXPECT_EQ(wide.computes("root"), 0u);
  wide.set("pick.chosen", std::int64_t{-1});
  EXPECT_DOUBLE_EQ(wide.pull<double>("pick.out"), 63 * 32 + 32);
  EXPECT_EQ(wide.computes("root"), 1u);
  wide.set("pick.chosen", std::int64_t{1} << 62);
  wide.set("root.a", 0.25);
  EXPECT_DOUBLE_EQ(wide.pull<double>("pick.out"), 62.25);
  EXPECT_EQ(wide.computes("n62"), 2u);
  EXPECT_EQ(wide.computes("n61"), 1u);
  // Owners in the shared segments of owners: the limit is of owners, not of segments
  TestGraph deep(LazyToys(true));
  deep.add("add", "root");
  deep.vary("root.a");
  std::string from = "root.out";
  for (int i = 0; i < 800; ++i) {
    const std::string n = std::to_string(i);
    deep.add("pick", "s" + n, {{"chosen", std::int64_t{1 + i % 2}}});
    for (int side : {0, 1}) {
      const std::string name = (side == 0 ? "left" : "right") + n;
      deep.add("add", name);
      deep.connect(from, name + ".a");
      deep.connect(name + ".out", "s" + n + ".input[" + std::to_string(side) + "]");
    }
    from = "s" + n + ".out";
  }
  deep.vary("s0.chosen");
  deep.want(from);
  deep.set("root.a", 3.0);
  EXPECT_DOUBLE_EQ(deep.pull<double>(from), 3);
  EXPECT_EQ(SharedSegments(*deep.plan), 800);
  deep.set("s0.chosen", 0);
  EXPECT_DOUBLE_EQ(deep.pull<double>(from), 0);
  deep.set("s0.chosen", 2);
  deep.set("root.a", 4.0);
  EXPECT_DOUBLE_EQ(deep.pull<double>(from), 4);
}

}  // namespace
}  // namespace kpsa::engine
