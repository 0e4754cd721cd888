// Random graphs of owners of several lazy inputs, beside their eager twins.
#include <gtest/gtest.h>

#include <random>

#include "tests/graph/lazy_toys.h"
#include "tests/support/test_graph.h"

namespace kpsa::engine {
namespace {

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

// Which segments may run: of lazy inputs that are chosen by owners that may run, and what such share.
std::vector<bool> Needed(const TestGraph& g, const std::vector<std::int64_t>& chosen) {
  const Plan& plan = *g.plan;
  std::vector<bool> needed(plan.segments().size(), false);
  needed[0] = true;
  for (bool changed = true; changed;) {
    changed = false;
    const auto need = [&](Index segment) {
      changed = changed || !needed[segment];
      needed[segment] = true;
    };
    for (Index s = 0; s < plan.steps().size(); ++s) {
      if (plan.steps()[s].branch == kNoIndex || !needed[plan.infos()[s].segment]) continue;
      const NodeId owner = plan.infos()[s].node;
      const Plan::Branch& branch = plan.branches()[plan.steps()[s].branch];
      const Index varying = plan.FindVarying({owner, g.graph.def(owner).FindAttribute("chosen"), -1, -1});
      for (std::size_t i = 0; i < branch.segment_of_lazy.size(); ++i) {
        if (branch.segment_of_lazy[i] != kNoIndex && (chosen[varying] >> branch.bit_of_lazy[i] & 1) != 0)
          need(branch.segment_of_lazy[i]);
      }
    }
    for (Index segment = 1; segment < plan.segments().size(); ++segment) {
      for (const Index user : plan.segments()[segment].users) {
        if (needed[user]) need(segment);
      }
    }
  }
  return needed;
}

#ifdef KPSA_WITH_ASAN
constexpr unsigned kPoses = 12;  // slow there
#else
constexpr unsigned kPoses = 30;
#endif

TEST(RandomSharedLazy, AgreesWithItsEagerTwin) {
  int shared = 0, nested = 0, with_points = 0, of_several = 0, slept = 0;
  for (unsigned seed = 0; seed < 150; ++seed) {
    SCOPED_TRACE(seed);
    RandomOwners lazy(seed, true), eager(seed, false);
    const Plan& plan = *lazy.g.plan;
    ASSERT_EQ(plan.varying().size(), eager.g.plan->varying().size());
    shared += SharedSegments(plan);
    for (const Plan::Segment& segment : plan.segments()) {
      if (segment.users.empty()) continue;
      EXPECT_LT(segment.begin, segment.end);
      nested += segment.parent != 0;
      with_points += segment.uses_workspace;
      of_several += segment.owner == kNoIndex;
    }
    Workspace workspace(plan);
    Evaluator parallel(lazy.g.plan, {true, nullptr}), sharing(lazy.g.plan, {false, &workspace}),
        other(lazy.g.plan, {false, &workspace});
    Evaluator* const all[] = {lazy.g.evaluator.get(), &parallel, &sharing, eager.g.evaluator.get()};
    std::vector<std::int64_t> chosen, of_other;  // by varying plug
    for (unsigned round = 0; round < kPoses; ++round) {
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
      const std::vector<bool> needed = Needed(lazy.g, chosen);
      for (Index g = 1; g < plan.segments().size(); ++g) {
        if (needed[g]) continue;
        slept += !plan.segments()[g].users.empty();
        for (Index s = plan.segments()[g].begin; s < plan.segments()[g].end; ++s)
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
  EXPECT_GT(of_several, 20);
  EXPECT_GT(slept, static_cast<int>(800 * kPoses / 30));
}

}  // namespace
}  // namespace kpsa::engine
