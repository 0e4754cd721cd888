#include "host/verdicts.h"

#include <gtest/gtest.h>

namespace kpsa::engine {
namespace {

TEST(FrameDecision, TheShareOfTheFullEvaluationDecides) {
  EXPECT_EQ((FrameDecision{"a", 0, 0.4, "hit"}).verdict(), FrameVerdict::kHit);
  EXPECT_EQ((FrameDecision{"a", 1e-9, 1.1, "far"}).verdict(), FrameVerdict::kBlend);
  EXPECT_EQ((FrameDecision{"a", 1, 9, "farther"}).verdict(), FrameVerdict::kMiss);
  Reasons reasons;
  EXPECT_EQ(reasons.MostFrequent(), "");
  reasons.Add("far", "frame 3");
  reasons.Add("farther", "frame 4");
  reasons.Add("farther", "frame 5");
  EXPECT_EQ(reasons.MostFrequent(), "most frequent reason (2 frames, first at frame 4): farther");
}

}  // namespace
}  // namespace kpsa::engine
