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
#include "tests/support/test_graph.h"
#include "tests/support/toy_nodes.h"

namespace kpsa {
namespace {

constexpr Index kPatchPoints = 210;

struct PatchKernel {
  std::vector<std::pair<std::uint32_t, Index>> from;  // by output point: the patch, and where in it
};

std::uint32_t PatchOf(Index point, int patches) { return point % static_cast<Index>(patches); }

void ComputePatches(ComputeContext& c) {
  const auto chosen = static_cast<std::uint64_t>(c.get<std::int64_t>(0));
  const ArrayView<ConstPointsView> patch = c.array<ConstPointsView>(1), all = c.array<ConstPointsView>(2);
  const PointsView& out = c.out_points(0);
  const auto& from = c.kernel_as<PatchKernel>().from;
  for (std::size_t i = 0; i < out.count; ++i) {
    out.x[i] = out.y[i] = out.z[i] = -1;
    if ((chosen >> patch.size() & 1) != 0) {
      out.x[i] = all[0].x[i], out.y[i] = all[0].y[i], out.z[i] = all[0].z[i];
    } else if ((chosen >> from[i].first & 1) != 0) {
      const ConstPointsView& p = patch[from[i].first];
      const Index at = from[i].second;
      out.x[i] = p.x[at], out.y[i] = p.y[at], out.z[i] = p.z[at];
    }
  }
}

// The toys, and: patches (chosen, patch[n] lazy, all[0] lazy together -> points, those of each chosen patch:
// every n-th point, or all of `all` by bit n), pick (chosen, input[n] lazy -> sum of the chosen ones). In the
// eager twin nothing is lazy.
void AddLazyToys(NodeRegistry& registry, bool lazy) {
  AddToyNodes(registry);
  NodeBuilder patches = registry.add("patches", "Each point from a patch of its own.");
  patches.structural("count", std::int64_t{kPatchPoints}).in("chosen", 0).points_in("patch").array();
  if (lazy) patches.lazy();
  patches.points_in("all").array();
  if (lazy) patches.lazy(true);
  patches.out("outPoints", Type::kPoints).compute(ComputePatches);
  if (lazy) {
    patches.decide([](ComputeContext& c) -> std::uint64_t {
      return static_cast<std::uint64_t>(c.get<std::int64_t>(0));
    });
  }
  patches
      .demand([](Demand& d) {
        const int count = d.structural().array_size("patch");
        std::vector<std::vector<Index>> points(static_cast<std::size_t>(count));
        for (Index point : d.output("outPoints").ToVector()) points[PatchOf(point, count)].push_back(point);
        for (int e = 0; e < count; ++e)
          d.Require("patch", e, PointSet::Of(points[static_cast<std::size_t>(e)], kPatchPoints));
        d.Require("all", 0, d.output("outPoints"));
      })
      .bind([](const Binding& b) -> Result<BoundKernel> {
        auto kernel = std::make_shared<PatchKernel>();
        const int count = b.structural().array_size("patch");
        for (Index point : b.output("outPoints").ToVector()) {
          const std::uint32_t e = PatchOf(point, count);
          const PointSet one = PointSet::Of({point}, kPatchPoints);
          kernel->from.emplace_back(e, b.input("patch", static_cast<int>(e)).PositionsOf(one)[0]);
        }
        return BoundKernel{kernel, 0, 0};
      })
      .point_count([](const Structural& s, std::string_view, int) -> Result<Index> {
        return static_cast<Index>(s.get_int("count"));
      })
      .cost(20000, 2);
  NodeBuilder pick = registry.add("pick", "The sum of some.");
  pick.in("chosen", 0).in("input", 0.0).array();
  if (lazy) pick.lazy();
  pick.out("out", Type::kDouble).compute([](std::int64_t chosen, ArrayView<double> input) {
    double sum = 0;
    for (std::uint32_t i = 0; i < input.size(); ++i) sum += (chosen >> i & 1) != 0 ? input[i] : 0;
    return sum;
  });
  if (lazy) {
    pick.decide([](ComputeContext& c) -> std::uint64_t {
      return static_cast<std::uint64_t>(c.get<std::int64_t>(0));
    });
  }
}
const NodeRegistry& LazyToys(bool lazy) {
  static const NodeRegistry* const registries = [] {
    auto* both = new NodeRegistry[2];
    AddLazyToys(both[0], false);
    AddLazyToys(both[1], true);
    return both;
  }();
  return registries[lazy ? 1 : 0];
}

int SharedSegments(const Plan& plan) {
  int count = 0;
  for (const Plan::Branch& branch : plan.branches()) count += branch.shared_segment != kNoIndex;
  return count;
}

// Of all outputs.
std::string OutputBytes(const Evaluator& evaluator) {
  std::string bytes;
  const auto add = [&](const void* from, std::size_t size) {
    bytes.append(static_cast<const char*>(from), size);
  };
  for (Index i = 0; i < evaluator.plan().outputs().size(); ++i) {
    if (evaluator.plan().outputs()[i].type != Type::kPoints) {
      add(&evaluator.Get<double>(i), sizeof(double));
      continue;
    }
    const ConstPointsView points = evaluator.Points(i);
    for (const float* component : {points.x, points.y, points.z})
      add(component, points.count * sizeof(float));
  }
  return bytes;
}

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
  const Index shared = BranchOf("p").shared_segment;
  ASSERT_NE(shared, kNoIndex);
  EXPECT_EQ(plan.segments()[shared].parent, 0u);
  EXPECT_EQ(plan.segments()[shared].owner, Step("p"));
  EXPECT_TRUE(plan.segments()[shared].uses_workspace);  // what probe measures
  EXPECT_EQ(SegmentName(plan, shared), "only if p asks for it");
  for (const char* name : {"world", "side", "probe"}) EXPECT_EQ(SegmentOf(name), shared) << name;
  for (const char* name : {"time", "seen", "p"}) EXPECT_EQ(SegmentOf(name), 0u) << name;
  std::set<Index> lazy;
  for (const Index g_of : BranchOf("p").segment_of_lazy) {
    lazy.insert(g_of);
    EXPECT_EQ(plan.segments()[g_of].parent, shared);
  }
  EXPECT_EQ(lazy.size(), kPatches + 1u);
  // An owner that is itself shared, and what its lazy inputs share
  const Index inner = BranchOf("side").shared_segment;
  ASSERT_NE(inner, kNoIndex);
  EXPECT_EQ(plan.segments()[inner].parent, shared);
  EXPECT_EQ(SegmentOf("root"), inner);
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
      if ((chosen >> PatchOf(i, kPatches) & 1) == 0 && chosen < kAllOfThem) continue;
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

// Random graphs of owners with several bits, in each other's lazy inputs, beside their eager twins.
struct RandomOwners {
  RandomOwners(unsigned seed, bool lazy) : g(LazyToys(lazy)), random(seed) {
    g.add("add", "time");
    g.add("source", "src", {{"count", std::int64_t{kPatchPoints}}, {"step", 0.25}});
    g.vary("time.a");
    g.vary("src.step");
    numbers = {"time.out"};
    points = {"src.outPoints"};
    for (int i = 0; i < 36; ++i) AddNode("n" + std::to_string(i));
    for (int i = 0; i < 3; ++i) {
      const std::vector<std::string>& from = Below(2) == 0 ? numbers : points;
      const std::string plug = from[from.size() - 1 - Below(std::min<std::size_t>(from.size(), 4))];
      std::vector<Index> some;
      for (int k = 0; k < 20; ++k) some.push_back(static_cast<Index>(Below(kPatchPoints)));
      const bool part = Below(2) == 0 && &from == &points;
      g.want(plug, part ? PointSet::Of(some, kPatchPoints) : PointSet());
    }
    EXPECT_TRUE(g.compile().ok());
  }
  std::size_t Below(std::size_t count) { return random() % count; }
  const std::string& Any(const std::vector<std::string>& from) {  // late ones more often
    return from[std::max(Below(from.size()), Below(from.size()))];
  }
  void AddNode(const std::string& name) {
    switch (Below(8)) {
      case 0:
        g.add("add", name, {{"b", 0.5}});
        g.connect(Any(numbers), name + ".a");
        if (Below(2) == 0) g.connect(Any(numbers), name + ".b");
        break;
      case 1:
        g.add("measure", name);
        g.connect(Any(points), name + ".points");
        break;
      case 2:
      case 3:
        g.add("move", name);
        g.connect(Any(points), name + ".points");
        g.connect(Any(numbers), name + ".offset");
        points.push_back(name + ".outPoints");
        return;
      case 4:
        g.add("smooth", name);
        g.connect(Any(points), name + ".points");
        points.push_back(name + ".outPoints");
        return;
      case 5: {
        g.add("patches", name);
        const std::string most = Any(points);
        for (int e = 0; e < 5; ++e)
          g.connect(Below(4) == 0 ? Any(points) : most, name + ".patch[" + std::to_string(e) + "]");
        g.connect(Any(points), name + ".all[0]");
        g.vary(name + ".chosen");
        points.push_back(name + ".outPoints");
        return;
      }
      default:
        g.add("pick", name);
        for (int e = 0; e < 3; ++e) g.connect(Any(numbers), name + ".input[" + std::to_string(e) + "]");
        g.vary(name + ".chosen");
    }
    numbers.push_back(name + ".out");
  }
  void Set(Evaluator& e, unsigned round, std::vector<std::int64_t>* chosen) const {
    std::mt19937 values(round);
    chosen->resize(g.plan->varying().size(), 0);
    for (Index v = 0; v < g.plan->varying().size(); ++v) {
      const std::uint32_t value = values();
      if (round > 0 && value % 3 == 0) continue;  // it keeps what it has
      if (v < 2) {
        e.Set(v, static_cast<double>(value >> 8 & 7) / 4);
      } else {
        (*chosen)[v] = (value >> 8) % 4 == 0 ? 0 : value >> 16 & 63;
        e.SetInt(v, (*chosen)[v]);
      }
    }
  }

  TestGraph g;
  std::mt19937 random;
  std::vector<std::string> numbers, points;
};

TEST(RandomSharedLazy, AgreesWithItsEagerTwin) {
  int shared = 0, nested = 0, with_points = 0, slept = 0;
  for (unsigned seed = 0; seed < 150; ++seed) {
    SCOPED_TRACE(seed);
    RandomOwners lazy(seed, true), eager(seed, false);
    const Plan& plan = *lazy.g.plan;
    ASSERT_EQ(plan.varying().size(), eager.g.plan->varying().size());
    shared += SharedSegments(plan);
    for (const Plan::Branch& branch : plan.branches()) {
      if (branch.shared_segment == kNoIndex) continue;
      const Plan::Segment& segment = plan.segments()[branch.shared_segment];
      EXPECT_LT(segment.begin, segment.end);
      nested += segment.parent != 0;
      with_points += segment.uses_workspace;
    }
    Workspace workspace(plan);
    Evaluator parallel(lazy.g.plan, {true, nullptr}), sharing(lazy.g.plan, {false, &workspace}),
        other(lazy.g.plan, {false, &workspace});
    Evaluator* const all[] = {lazy.g.evaluator.get(), &parallel, &sharing, eager.g.evaluator.get()};
    std::vector<std::int64_t> chosen, of_other;  // by varying plug
    for (unsigned round = 0; round < 30; ++round) {
      const std::vector<std::uint64_t> before = lazy.g.profile->counts();
      if (round % 2 == 1) {  // it leaves other values in the workspace
        lazy.Set(other, round + 1000, &of_other);
        ASSERT_TRUE(other.Evaluate().ok());
      }
      for (Evaluator* e : all) {
        lazy.Set(*e, round, &chosen);
        if (round % 4 == 3) {
          ASSERT_TRUE(e->Pull(round % static_cast<Index>(plan.outputs().size())).ok());
        }
        ASSERT_TRUE(e->Evaluate().ok());
      }
      const std::vector<std::uint64_t> after = lazy.g.profile->counts();
      for (std::size_t s = 0; s < after.size(); ++s) EXPECT_LE(after[s], before[s] + 1);
      for (const Plan::Branch& branch : plan.branches()) {
        if (branch.shared_segment == kNoIndex) continue;
        const Plan::Segment& segment = plan.segments()[branch.shared_segment];
        const NodeId owner = plan.infos()[segment.owner].node;
        const Index varying =
            plan.FindVarying({owner, lazy.g.graph.def(owner).FindAttribute("chosen"), -1, -1});
        if (chosen[varying] != 0) continue;
        ++slept;
        for (Index s = segment.begin; s < segment.end; ++s)
          EXPECT_EQ(after[s], before[s]) << plan.step_name(s);
      }
      for (Evaluator* e : all)
        ASSERT_EQ(OutputBytes(*e), OutputBytes(*eager.g.evaluator)) << "round " << round;
    }
  }
  // What the graphs were to contain
  EXPECT_GT(shared, 100);
  EXPECT_GT(nested, 20);
  EXPECT_GT(with_points, 20);
  EXPECT_GT(slept, 800);
}

}  // namespace
}  // namespace kpsa
