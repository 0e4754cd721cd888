// What a bench measured, as text and as JSON.
#include "report/bench_report.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>

namespace kpsa::engine {
namespace {

using Json = nlohmann::json;

TEST(BenchReport, WhatIsNotKnownIsNoNumber) {
  BenchResult result;
  result.per_frame.emplace_back();
  const std::string text = BenchText({result}, {}) + FramesText({result});
  EXPECT_NE(text.find("speedup    -; ceiling -, bound"), std::string::npos) << text;
  EXPECT_EQ(text.find("0.0x"), std::string::npos) << text;
  const Json json = Json::parse(BenchJson({result}, {}));
  EXPECT_TRUE(json["ceiling"]["speedup"].is_null() && json["speedup"].is_null()) << json;
  EXPECT_TRUE(json["error"]["worst_frame"].is_null()) << json["error"];
}

TEST(BenchReport, TheSpeedupHasASpread) {
  BenchResult result;
  result.full_ms = 1, result.accelerated_ms = 0.02, result.speedup_range = {45, 55};
  BenchContext context;
  context.options.runs = 3;
  EXPECT_NE(BenchText({result}, context).find("speedup    50.00x (45.00 to 55.00 over the runs)"),
            std::string::npos)
      << BenchText({result}, context);
}

TEST(BenchReport, AdvisesSamplesWhereTheseMayHelpAlone) {
  BenchResult result;
  result.most_frequent_reason = "most frequent reason (9 frames, first at frame 1): unlike the trained poses";
  EXPECT_EQ(BenchWords(result).where_few, "train on clips that are like these, or on more samples");
  result.most_frequent_reason =
      "most frequent reason (9 frames, first at frame 1): tail_3.matrix is outside its trained range";
  EXPECT_EQ(BenchWords(result).where_few,
            "train on clips that are like these, or widen the controls that these go beyond");
}

TEST(BenchReport, SaysWhySlowerAndWhatToDoWhereFramesMiss) {
  BenchResult result;
  result.full_ms = 1, result.accelerated_ms = 1.2, result.frames = 10, result.promise.tolerance = 0.01;
  result.clips = {"walk", "run"};
  BenchContext context;
  context.rig = "man.yaml";
  const auto has = [&](const char* words) {
    const std::string text = BenchText({result}, context);
    EXPECT_NE(text.find(words), std::string::npos) << text;
  };
  has("slower than the full evaluation: no frame hits, and frames that miss are judged besides\n");
  has("next: kpsa learn man.yaml --clips walk,run --force, which trains again");
  context.kpsa = {"old.kpsa"};
  has("next: kpsa learn man.yaml --kpsa old.kpsa --clips walk,run --force");
  context.set = true;  // learning would not set it
  has("next: kpsa eval man.yaml");
  context.set = false;
  result.clips = {"(rest)"};
  has("next: kpsa eval man.yaml --kpsa old.kpsa -o fast.npz");
  result.clips = {"walk"}, result.hits = 5;
  has("next: kpsa eval");
  result.promise.frames = 10, result.promise.beyond = 5, result.promise.rate = 0.03;
  has("next: kpsa learn man.yaml --kpsa old.kpsa --clips walk --force");
  result.hits = 10;  // nothing misses that could be learnt
  has("next: kpsa eval");
  result.hits = 5, result.promise.beyond = 0;
  result.full_ms_on_hits = 1, result.accelerated_ms_on_hits = 0.1;
  has("frames that miss cost it once more, and too few hit");
  result.accelerated_ms_on_hits = 2;
  has("even frames that hit cost more");
}

}  // namespace
}  // namespace kpsa::engine
