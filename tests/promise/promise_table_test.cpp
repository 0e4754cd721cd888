#include "bench/promise_table.h"

#include <gtest/gtest.h>

#include <limits>

namespace kpsa::engine {
namespace {

PromiseCase Case(double promised) { return {"rig", 1, 0.002, 1, promised}; }

PromiseRow Row(std::size_t violations, std::size_t hit_violations, std::size_t hits, double promised) {
  PromiseRow row;
  row.of = Case(promised);
  row.poses = 600;
  row.hits = hits;
  row.violations = violations;
  row.hit_violations = hit_violations;
  return row;
}

TEST(PromiseTable, CountsWhatWasAccepted) {
  const PromiseOutcome outcomes[] = {{PromiseVerdict::kHit, 0.001},
                                     {PromiseVerdict::kHit, 0.002},  // as far as the tolerance is no
                                                                     // violation
                                     {PromiseVerdict::kHit, 0.003},
                                     {PromiseVerdict::kBlend, 0.007},
                                     {PromiseVerdict::kBlend, 0.0005},
                                     {PromiseVerdict::kMiss, 0.1}};
  const PromiseRow row = CountOutcomes(Case(0.05), TrialKind::kMargin, outcomes);
  EXPECT_EQ(row.kind, TrialKind::kMargin);
  EXPECT_EQ(row.poses, 6u);
  EXPECT_EQ(row.hits, 3u);
  EXPECT_EQ(row.blends, 2u);
  EXPECT_EQ(row.misses, 1u);
  EXPECT_EQ(row.violations, 2u);
  EXPECT_EQ(row.hit_violations, 1u);
  EXPECT_EQ(row.far, 1u);
  EXPECT_NEAR(row.worst, 3.5, 1e-12);
}

TEST(PromiseTable, PointsThatAreNotFiniteAreViolations) {
  const PromiseOutcome outcomes[] = {{PromiseVerdict::kHit, std::numeric_limits<double>::infinity()}};
  EXPECT_EQ(CountOutcomes(Case(0.05), TrialKind::kSampler, outcomes).violations, 1u);
}

// One-sided 95 % lower bounds: 39 of 600 gives 4.92 %, 40 of 600 gives 5.07 %; 18 of 120 gives 9.9 %, 20 of
// 120 gives 11.3 %.
TEST(PromiseTable, BrokenIsWhatChanceDoesNotExplain) {
  EXPECT_FALSE(Row(30, 0, 500, 0.05).broken());
  EXPECT_FALSE(Row(39, 0, 500, 0.05).broken());
  EXPECT_TRUE(Row(40, 0, 500, 0.05).broken());
  EXPECT_FALSE(Row(20, 18, 120, 0.05).broken());
  EXPECT_TRUE(Row(20, 20, 120, 0.05).broken()) << "most hits are fine elsewhere, but not here";
  EXPECT_FALSE(Row(0, 0, 0, 0.05).broken()) << "a subspace that never hits breaks no promise";
}

TEST(PromiseTable, PutsSeedsTogetherAndMarksWhatIsBroken) {
  std::vector<PromiseRow> rows{Row(6, 6, 600, 0.05), Row(60, 60, 600, 0.05)};
  rows[1].of.seed = 2;
  const std::vector<WalkRow> walks{{rows[0].of, 12, 8, 0.5, "a.rotateX"},
                                   {rows[1].of, 12, 9, 2.25, "b.rotateX"}};
  const std::string markdown = PromiseMarkdown(rows, walks);
  EXPECT_NE(markdown.find("| rig | 1 = 2 mm | 5 % | 100 % | **5.5 %** | - | - | - | 0.0 | 2.2 | 1 of 2 |"),
            std::string::npos)
      << markdown;
  const std::vector<WalkRow> missed{{rows[0].of, 12, 0, 0, ""}};
  EXPECT_NE(PromiseMarkdown(rows, missed).find("| 0.0 | - | 1 of 2 |"), std::string::npos)
      << "walks of misses show nothing";
  const std::string text = PromiseText(rows, walks);
  EXPECT_NE(text.find("10.0 % [7.7, 12.7]"), std::string::npos) << text;
  EXPECT_EQ(text.find("BROKEN"), text.rfind("BROKEN")) << text;
}

}  // namespace
}  // namespace kpsa::engine
