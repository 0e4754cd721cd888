// Rig::Bench: what it reports is what scenes of both rigs show.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "kpsa/kpsa.h"
#include "tests/support/temporary_folder.h"

namespace {

using kpsa::BenchReport;
using kpsa::Problem;
using kpsa::Rig;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

class RigBench : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<kpsa::engine::TemporaryFolder>();
    for (const char* file : {"hello.yaml", "hello.glb"})
      std::filesystem::copy(std::string(KPSA_SCENES_DIR) + "/hello/" + file, folder_->path() + "/" + file);
    auto rig = kpsa::Library().Load(folder_->path() + "/hello.yaml");
    ASSERT_TRUE(rig) << kpsa::ToText(rig.problems());
    rig_ = std::make_unique<Rig>(*rig);
    kpsa::TrainingOptions options;
    options.samples = 200;
    const auto trained = rig_->Train(options);
    ASSERT_TRUE(trained) << kpsa::ToText(trained.problems());
  }
  static void TearDownTestSuite() { rig_.reset(), folder_.reset(); }
  void SetUp() override { ASSERT_NE(rig_, nullptr); }

  static Rig Fast(const kpsa::AccelerationOptions& options = {}) {
    auto fast = rig_->Accelerated(options);
    EXPECT_TRUE(fast) << kpsa::ToText(fast.problems());
    return fast ? *fast : *rig_;
  }
  static BenchReport Bench(const Rig& rig) {
    kpsa::BenchOptions options;
    options.runs = 1;
    const auto report = rig.Bench(options);
    EXPECT_TRUE(report) << kpsa::ToText(report.problems());
    return report ? *report : BenchReport();
  }
  static Problem Refused(const Rig& rig, const kpsa::BenchOptions& options) {
    const auto report = rig.Bench(options);
    EXPECT_FALSE(report);
    return report ? Problem() : report.problems().front();
  }

  static inline std::unique_ptr<kpsa::engine::TemporaryFolder> folder_;
  static inline std::unique_ptr<Rig> rig_;
};

TEST_F(RigBench, SaysWhatScenesShow) {
  const Rig fast = Fast();
  const BenchReport report = Bench(fast);
  EXPECT_EQ(report.clips, std::vector<std::string>{"wave"}) << "the rig's test clip";
  kpsa::Scene exact(*rig_), scene(fast);
  ASSERT_TRUE(exact.Play("wave") && scene.Play("wave"));
  std::size_t hits = 0, blends = 0, beyond = 0;
  double worst = 0;
  for (std::size_t f = 0; f < report.frames; ++f) {
    for (kpsa::Scene* each : {&exact, &scene}) each->SetTime(static_cast<double>(f) / fast.fps());
    const auto a = exact.Points("column"), b = scene.Points("column");
    ASSERT_TRUE(a && b);
    double largest = 0;
    for (std::size_t i = 0; i < a->size(); i += 3)
      largest = std::max(largest, std::hypot(double{(*a)[i]} - (*b)[i], double{(*a)[i + 1]} - (*b)[i + 1],
                                             double{(*a)[i + 2]} - (*b)[i + 2]));
    worst = std::max(worst, largest);
    hits += scene.verdict().hit;
    blends += !scene.verdict().hit && scene.verdict().full_share < 1;
    beyond += scene.verdict().full_share < 1 && largest > report.tolerance;
  }
  EXPECT_GT(report.frames, 10u);
  EXPECT_GT(hits, 0u);
  EXPECT_EQ(report.hits, hits);
  EXPECT_EQ(report.blends, blends);
  EXPECT_EQ(report.beyond_tolerance, beyond);
  EXPECT_NEAR(report.error_max, worst, 1e-9);
  EXPECT_GT(report.error_rms, 0);
  EXPECT_LE(report.error_rms, report.error_max);
  EXPECT_DOUBLE_EQ(report.tolerance, 5e-4);
  EXPECT_GT(report.full_ms, 0);
  EXPECT_DOUBLE_EQ(report.speedup, report.full_ms / report.accelerated_ms);
  EXPECT_GT(report.speedup_on_hits, 0);
}

TEST_F(RigBench, ToleranceDecidesWhatHits) {
  const BenchReport none = Bench(Fast({.tolerance = 0}));
  EXPECT_EQ(none.hits + none.blends, 0u);
  EXPECT_EQ(none.error_max, 0);
  EXPECT_TRUE(none.promise_kept);
  EXPECT_FALSE(none.most_frequent_reason.empty());
  EXPECT_EQ(none.speedup_on_hits, 0);
  const BenchReport any = Bench(Fast({.tolerance = kInfinity}));
  EXPECT_EQ(any.tolerance, kInfinity);
  EXPECT_TRUE(any.promise_kept) << "nothing is promised";
  EXPECT_EQ(any.beyond_tolerance, 0u);
  EXPECT_GT(any.hits, none.hits);
}

TEST_F(RigBench, IsCancelledByItsProgress) {
  std::size_t calls = 0;
  kpsa::BenchOptions options;
  options.progress = [&](std::size_t frames) {
    EXPECT_EQ(frames, calls);
    return ++calls < 4;
  };
  EXPECT_EQ(Refused(Fast(), options).kind, Problem::Kind::kInterrupted);
  EXPECT_EQ(calls, 4u);
  const std::size_t frames = Bench(Fast()).frames;
  calls = 0;
  options.progress = [&](std::size_t) { return ++calls < frames + 3; };  // while frames are timed
  EXPECT_EQ(Refused(Fast(), options).kind, Problem::Kind::kInterrupted);
  EXPECT_EQ(calls, frames + 3) << "no call after the one that cancels";
  options.progress = [](std::size_t) -> bool { throw 7; };
  EXPECT_THROW((void)Fast().Bench(options), int);
}

TEST_F(RigBench, RefusesWhatItCannotDo) {
  EXPECT_NE(Refused(*rig_, {}).message.find("not accelerated"), std::string::npos);
  EXPECT_NE(Refused(Fast(), {.clips = {"wavy"}}).message.find("wave"), std::string::npos) << "the nearest";
  EXPECT_NE(Refused(Fast(), {.runs = 0}).message.find("runs"), std::string::npos);
  EXPECT_NE(Refused(Fast(), {.threads = 0}).message.find("threads"), std::string::npos);
}

}  // namespace
