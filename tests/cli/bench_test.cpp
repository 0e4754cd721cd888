// What kpsa bench says besides errors: whether the promise was kept, what its clips are worth, and times that
// a busy machine does not stretch.
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>
#include <thread>

#include "cli/bench_promise.h"
#include "cli/bench_report.h"
#include "graph/profile.h"
#include "host/bench/frame_times.h"
#include "tests/cli/hello_folder.h"
#include "tests/cli/process.h"
#include "tests/cli/rig_run.h"

namespace kpsa::engine {
namespace {

using Json = nlohmann::json;

Promise FivePercent() {
  Promise promise;
  promise.tolerance = 1e-3, promise.rate = 0.05;
  return promise;
}

TEST(Promise, IsKeptUpToItsRate) {
  Promise promise = FivePercent();
  for (int f = 0; f < 19; ++f) promise.Add("talk", f, true, true, 4e-4);
  EXPECT_TRUE(promise.kept());
  promise.Add("talk", 19, true, true, 2e-3);
  EXPECT_TRUE(promise.kept()) << "1 of 20";
  EXPECT_NE(
      promise.Text("").find("kept: 1 of 20 frames beyond 1 mm (promised 5 %), 1 of 20 hits (promised 10 %)"),
      std::string::npos)
      << promise.Text("");
  EXPECT_NE(promise.Text("").find("worst accepted: frame 19 of talk, 2.00 tolerances"), std::string::npos);
  promise.Add("talk", 20, true, true, NAN);
  EXPECT_FALSE(promise.kept()) << "an error that is no number is beyond every tolerance";
  EXPECT_TRUE(promise.Text("").starts_with("PROMISE BROKEN: 9.52 % > 5 % of frames beyond 1 mm (2 of 21)"))
      << promise.Text("");
  EXPECT_NE(promise.Text("").find("what helps: "), std::string::npos);
}

TEST(Promise, HitsHaveTwiceTheRate) {
  Promise promise = FivePercent();
  for (int f = 0; f < 95; ++f) promise.Add("talk", f, false, false, 0);
  for (int f = 95; f < 100; ++f) promise.Add("talk", f, true, true, f < 96 ? 2e-3 : 0);
  EXPECT_FALSE(promise.kept()) << "1 % of the frames, but 20 % of the hits";
  EXPECT_TRUE(promise.Text("").starts_with("PROMISE BROKEN: 20 % > 10 % of hits beyond 1 mm (1 of 5)"))
      << promise.Text("");
}

TEST(Promise, MissesAndFramesThatAreAcceptedAnywayBreakNone) {
  Promise promise = FivePercent();
  promise.Add("talk", 1, false, false, 1);  // as of a mesh that nothing accelerates
  EXPECT_TRUE(promise.kept());
  EXPECT_NE(promise.Text("").find("no frame was accepted"), std::string::npos);
  promise.tolerance = 1e30;
  promise.Add("talk", 2, true, true, 1);
  EXPECT_FALSE(promise.promised());
  EXPECT_TRUE(promise.kept());
  EXPECT_EQ(promise.Text(""), "none: every frame is accepted, whatever its error\n");
}

TEST(FrameTimes, WhatIsTakenOffComesFromTheInterruptedFrames) {
  std::vector<double> times = {10, 300, 5010, 12, 2010}, floors = {10, 290, 10, 10, 10};
  TakeOff(7000, floors, times);
  EXPECT_EQ(times, (std::vector<double>{10, 300, 10, 12, 10}));
  TakeOff(5, floors, times);
  EXPECT_EQ(times, (std::vector<double>{10, 295, 10, 12, 10}));
  TakeOff(1e9, floors, times);
  EXPECT_EQ(times, floors) << "none below its floor";
}

TEST(FrameTimes, WaitingIsNoWork) {
  constexpr std::uint64_t kWait = 30'000'000;
  for (const bool cpu : {true, false}) {
    FrameTimes times(3, cpu);
    for (int run = 0; run < 3; ++run) {
      times.BeginTurn(0);
      for (int f = 0; f < 3; ++f) {
        const std::uint64_t begin = ProfileClock();
        if (f == run) std::this_thread::sleep_for(std::chrono::nanoseconds(kWait));
        times.Add(ProfileClock() - begin);
      }
      times.EndTurn();
    }
    double most = 0;
    for (const std::vector<double>& runs : times.Finish()) {
      ASSERT_EQ(runs.size(), 3u);
      most = std::max(most, *std::max_element(runs.begin(), runs.end()));
    }
    EXPECT_EQ(most < 0.5 * kWait, cpu) << most;
    if (cpu) {
      EXPECT_GT(times.wall_ns(), 10 * times.cpu_ns());
    }
  }
}

// In a bench of its own, frames of a known error.
class Bench : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder;
    const std::shared_ptr<const Subspace> trained = TrainRig(kHello, QuickTraining(), {"wave"});
    ASSERT_NE(trained, nullptr);
    // A calibration that knows of no errors: it accepts whatever the tolerance
    ASSERT_TRUE(WriteSubspace(*WithThreshold(*trained, 1e6, 1e7), *folder_ / "bold.kpsa").ok());
  }
  static void TearDownTestSuite() { delete folder_; }
  static ProcessResult Run(const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"bench", kHello, "--kpsa", *folder_ / "bold.kpsa", "--runs", "3"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return RunKpsa(arguments);
  }
  static inline TemporaryFolder* folder_ = nullptr;
};

TEST_F(Bench, ChecksThePromise) {
  const ProcessResult broken = Run({"--tolerance", "0.001mm", "--check", "-q"});
  EXPECT_EQ(broken.exit_code, 1);
  EXPECT_NE(broken.out.find("promise    PROMISE BROKEN: "), std::string::npos) << broken.out;
  EXPECT_NE(broken.out.find("worst accepted: frame "), std::string::npos) << broken.out;
  EXPECT_NE(broken.err.find("PROMISE BROKEN: "), std::string::npos) << broken.err;
  const ProcessResult unchecked = Run({"--tolerance", "0.001mm", "--json"});
  EXPECT_EQ(unchecked.exit_code, 0) << unchecked.err;
  const Json json = Json::parse(unchecked.out);
  EXPECT_EQ(json["promise"]["kept"], false);
  EXPECT_EQ(json["promise"]["promised"], 0.05);
  EXPECT_EQ(json["promise"]["promised_of_hits"], 0.1);
  EXPECT_GT(json["promise"]["rate"], 0.5);
  double worst = 0;
  for (const Json& frame : json["per_frame"]) worst = std::max(worst, frame["max"].get<double>());
  EXPECT_EQ(json["promise"]["worst_accepted"]["error"], worst);
  EXPECT_DOUBLE_EQ(json["promise"]["worst_accepted"]["tolerances"], worst / 1e-6);

  const ProcessResult kept = Run({"--tolerance", "20mm", "--check"});
  EXPECT_EQ(kept.exit_code, 0) << kept.out;
  EXPECT_NE(kept.out.find("promise    kept: 0 of 49 frames beyond 20 mm (promised 5 %)"), std::string::npos)
      << kept.out;
  EXPECT_EQ(Run({"--tolerance", "any", "--check"}).exit_code, 0);
}

TEST_F(Bench, SaysWhatItsClipsAreWorth) {
  EXPECT_NE(Run({}).err.find("note: wave was trained on: its errors say nothing about new frames"),
            std::string::npos);
  const ProcessResult over = Run({"--frames", "1000:1003"});  // the clip has ended
  EXPECT_NE(over.err.find("note: nothing moves in wave"), std::string::npos) << over.err;
  EXPECT_EQ(Run({}).err.find("nothing moves"), std::string::npos);
  EXPECT_EQ(Run({"--frames", "4:4"}).err.find("nothing moves in"), std::string::npos) << "one frame";
}

TEST_F(Bench, TellsTheSpreadOfItsTimes) {
  const ProcessResult run = Run({"--json"});
  const Json json = Json::parse(run.out);
  EXPECT_EQ(json["clock"], "cpu");
  EXPECT_GT(json["wall_over_cpu"], 0.5);
  for (const auto& [value, range] :
       {std::pair{json["speedup"], json["speedup_range"]},
        {json["full"]["ms_per_frame"], json["full"]["ms_range"]},
        {json["accelerated"]["ms_per_frame"], json["accelerated"]["ms_range"]}}) {
    EXPECT_LE(range[0], value);
    EXPECT_GE(range[1], value);
    EXPECT_GT(range[0], 0.0);
    EXPECT_LT(range[0], range[1]);
  }
  // Parts are of the total, whatever recording them costs
  double parts = 0;
  for (const char* part : {"graph", "cues", "projection", "reconstruction", "downstream", "misses"})
    parts += json["accelerated"][part].get<double>();
  EXPECT_NEAR(parts, json["accelerated"]["ms_per_frame"], 1e-3 * parts);
  EXPECT_GE(json["accelerated"]["parts_recorded"], 0.999 * parts);
  const ProcessResult text = Run({"--threads", "2"});
  EXPECT_NE(text.out.find(" over the runs)"), std::string::npos) << text.out;
  EXPECT_NE(text.out.find("wall time"), std::string::npos) << text.out;
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

}  // namespace
}  // namespace kpsa::engine
