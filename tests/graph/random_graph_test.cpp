// Random graphs, random edits, random sets and pulls: the engine against a naive twin (tests/support/twin_rounds).
//
//   KPSA_SEEDS=5000:6000 build/test_graph --gtest_filter='RandomGraph.*'    # seeds 5000 to 5999
//   KPSA_SEEDS=412:413 ...                                                  # one, as a failure names it
#include <gtest/gtest.h>

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <string_view>

#include "base/parallel.h"
#include "tests/support/toy_nodes.h"
#include "tests/support/twin_rounds.h"

namespace kpsa::engine {
namespace {

struct Seeds {
  unsigned begin = 0, end = 1000;
  bool of_all = true;  // none were asked for
};

// KPSA_SEEDS, FIRST:END; nothing where it is something else.
std::optional<Seeds> SeedsOf(const char* text) {
  if (text == nullptr) return Seeds();
  Seeds seeds{0, 0, false};
  const std::string_view all = text;
  const std::size_t colon = std::min(all.find(':'), all.size());
  const auto read = [](std::string_view part, unsigned* value) {
    const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), *value);
    return error == std::errc() && end == part.data() + part.size();
  };
  if (!read(all.substr(0, colon), &seeds.begin) || colon == all.size() ||
      !read(all.substr(colon + 1), &seeds.end) || seeds.end <= seeds.begin)
    return std::nullopt;
  return seeds;
}

std::string RunSeed(unsigned seed, TwinCounts* counts) {
  ThreadLimit limit(seed % 3 == 0 ? 1 : seed % 3 == 1 ? 2 : 4);
  TwinSizes sizes;
  sizes.nodes = 20 + static_cast<int>(seed % 5) * 10;
  return Disagreement(ToyRegistry(), Choices(seed), sizes, counts);
}

TEST(RandomGraph, AgreesWithTheNaiveTwin) {
  const std::optional<Seeds> seeds = SeedsOf(std::getenv("KPSA_SEEDS"));
  ASSERT_TRUE(seeds.has_value()) << "KPSA_SEEDS: expected FIRST:END, as in 0:5000";
#ifdef KPSA_WITH_ASAN
  const unsigned step = seeds->of_all ? 11 : 1;  // slow there
#else
  const unsigned step = 1;
#endif
  TwinCounts counts;
  for (unsigned seed = seeds->begin; seed < seeds->end; seed += step) {
    const std::string fault = RunSeed(seed, &counts);
    ASSERT_EQ(fault, "") << "KPSA_SEEDS=" << seed << ":" << seed + 1;
  }
  std::printf("plans %d (%d refused), steps %d (%d units), segments %d (%d shared), gathers %d\n",
              counts.plans, counts.refused, counts.steps, counts.unit_steps, counts.segments,
              counts.shared_segments, counts.gathers);
  std::printf("evaluations %d (%d failed), frames %d (%d failed), lazy steps that ran %d, invalidated %d\n",
              counts.evaluations, counts.failures, counts.frames, counts.failed_frames, counts.lazy_runs,
              counts.invalidated);
  if (!seeds->of_all) return;
  // What the graphs were to contain
  const int all = static_cast<int>((seeds->end - seeds->begin) / step);
  EXPECT_GT(counts.plans, 3 * all / 2);
  EXPECT_GT(counts.refused, all / 20);
  EXPECT_GT(counts.steps, 10 * all);
  EXPECT_GT(counts.unit_steps, all / 4);
  EXPECT_GT(counts.segments, 2 * all);
  EXPECT_GT(counts.shared_segments, all / 10);
  EXPECT_GT(counts.gathers, all / 4);
  EXPECT_GT(counts.lazy_runs, all);
  EXPECT_GT(counts.failures, all / 2);
  EXPECT_LT(counts.failures, 2 * all);
  EXPECT_GT(counts.failed_frames, all / 2);
  EXPECT_LT(counts.failed_frames, 4 * all);
  EXPECT_GT(counts.invalidated, all / 4);
}

TEST(RandomGraph, SeedsAreReadOrRefused) {
  EXPECT_EQ(SeedsOf(nullptr)->end, 1000u);
  EXPECT_EQ(SeedsOf("5:8")->begin, 5u);
  EXPECT_EQ(SeedsOf("5:8")->end, 8u);
  for (const char* wrong : {"", "5", "5:", ":8", "8:5", "5:5", "a:8", "5:8 ", "-1:8", "5:99999999999"})
    EXPECT_FALSE(SeedsOf(wrong).has_value()) << wrong;
}

}  // namespace
}  // namespace kpsa::engine
