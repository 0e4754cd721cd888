// What a frame of an accelerated rig is: a hit, a blend or the full evaluation, whatever came before it and
// whoever evaluates it. On the bundled hello rig with thresholds that make all three happen; with what is reconstructed
// the points, and those before the last step of its mush (graph/last_step.h).
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <random>
#include <tuple>

#include "graph/frames.h"
#include "tests/cli/hello_folder.h"
#include "tests/cli/process.h"
#include "tests/cli/rig_run.h"

namespace kpsa::engine {
namespace {

class KpsaFrames : public ::testing::TestWithParam<TrainOptions::Inner> {
 protected:
  void SetUp() override {
    if (const auto known = prepared_.find(of_inner()); known != prepared_.end()) {
      std::tie(trained_, mixed_, poses_, tau_lo_, tau_) = known->second;
      return;
    }
    TrainOptions options = QuickTraining();
    options.inner = GetParam();
    if (of_inner())
      options.tolerance = 0.05 * kQuickTolerance;  // else its ranges reach beyond all poses here
    trained_ = TrainRig(kHello, options);
    ASSERT_NE(trained_, nullptr);
    ASSERT_EQ(trained_->of_inner(), of_inner());
    // Poses of which some leave the trained ranges; thresholds among the scores of the others
    RigRun run(kHello, {.subspace = WithGuardsOnly(*trained_)});
    ASSERT_TRUE(run.ok()) << run.error;
    std::vector<double> scores;
    std::size_t outside = 0;
    for (double reach = 1.3; outside < 5; reach += 0.1) {  // how far ranges are trusted, training finds out
      ASSERT_LT(reach, 4);
      poses_ = SmoothPoses(run.rig, 60, reach);
      scores.clear(), outside = 0;
      for (const auto& pose : poses_) {
        run.Pose(pose);
        const RunFrame frame = run.Evaluate();
        if (frame.hit) scores.push_back(frame.score);
        outside += frame.full_weight == 1;
      }
    }
    ASSERT_GT(scores.size(), 12u);
    std::sort(scores.begin(), scores.end());
    tau_lo_ = scores[scores.size() / 3], tau_ = scores[2 * scores.size() / 3];
    mixed_ = WithThreshold(*trained_, tau_lo_, tau_);
    prepared_[of_inner()] = {trained_, mixed_, poses_, tau_lo_, tau_};
  }
  static void TearDownTestSuite() { trained_.reset(), mixed_.reset(), poses_.clear(), prepared_.clear(); }
  // Inner points follow the skin so well that their ranges are trusted much farther
  static double beyond() { return of_inner() ? 2.6 : 1.5; }
  static bool of_inner() { return GetParam() == TrainOptions::Inner::kAlways; }

  static std::vector<RunFrame> InOrder() {
    RigRun run(kHello, {.subspace = mixed_});
    EXPECT_TRUE(run.ok()) << run.error;
    std::vector<RunFrame> frames;
    for (const auto& pose : poses_) {
      run.Pose(pose);
      frames.push_back(run.Evaluate());
    }
    return frames;
  }

  static void ExpectBlend(const std::vector<float>& points, const std::vector<float>& reconstructed,
                          const std::vector<float>& exact, double weight) {
    for (std::size_t i = 0; i < exact.size(); ++i) {
      ASSERT_NEAR(points[i], reconstructed[i] + weight * (static_cast<double>(exact[i]) - reconstructed[i]),
                  1e-7);
    }
  }

  static inline std::shared_ptr<const Subspace> trained_, mixed_;
  static inline std::vector<std::vector<double>> poses_;
  static inline double tau_lo_ = 0, tau_ = 0;
  static inline std::map<bool, std::tuple<std::shared_ptr<const Subspace>, std::shared_ptr<const Subspace>,
                                          std::vector<std::vector<double>>, double, double>>
      prepared_;  // by of_inner()
};

TEST_P(KpsaFrames, HitsBlendsAndMissesAreWhatTheScoreSays) {
  RigRun full(kHello), pure(kHello, {.subspace = trained_, .accelerate = {.tolerance = kInfinity}});
  std::size_t hits = 0, blends = 0, misses = 0, guard_misses = 0;
  const std::vector<RunFrame> frames = InOrder();
  for (std::size_t f = 0; f < frames.size(); ++f) {
    SCOPED_TRACE(f);
    const RunFrame& frame = frames[f];
    full.Pose(poses_[f]);
    pure.Pose(poses_[f]);
    const std::vector<float> exact = full.Evaluate().points, reconstructed = pure.Evaluate().points;
    ASSERT_FALSE(SameBytes(exact, reconstructed));  // so that equality below says something
    const bool guarded = frame.reason == MissReason::kOutOfRange;
    EXPECT_EQ(frame.hit, frame.full_weight == 0);
    if (frame.hit) {
      ++hits;
      EXPECT_EQ(frame.reason, MissReason::kNone);
      EXPECT_LE(frame.score, tau_lo_);
      EXPECT_TRUE(SameBytes(frame.points, reconstructed));
    } else if (frame.full_weight < 1) {
      blends += !guarded;
      const double u = std::clamp((frame.score - tau_lo_) / (tau_ - tau_lo_), 0.0, 1.0),
                   weight = u * u * (3 - 2 * u);
      // The larger of the two counts
      EXPECT_GT(frame.full_weight, guarded ? weight : weight - 1e-9);
      ExpectBlend(frame.points, reconstructed, exact, guarded ? frame.full_weight : weight);
    } else {
      ++(guarded ? guard_misses : misses);
      EXPECT_TRUE(guarded || frame.reason == MissReason::kScore || frame.reason == MissReason::kDoubt);
      EXPECT_TRUE(guarded || frame.score >= tau_);
      EXPECT_TRUE(SameBytes(frame.points, exact));  // the full evaluation, bit for bit
    }
  }
  EXPECT_GE(hits, 5u);
  EXPECT_GE(blends, 5u);
  EXPECT_GE(misses, 5u);
  EXPECT_GE(guard_misses, 3u);
}

// Outside a trained range the full evaluation comes in as it does with the score, over the guard's ramp.
TEST_P(KpsaFrames, GuardsBlendTheFullEvaluationIn) {
  RigRun full(kHello), pure(kHello, {.subspace = trained_, .accelerate = {.tolerance = kInfinity}}),
      guarded(kHello, {.subspace = WithGuardsOnly(*trained_)});
  ASSERT_TRUE(guarded.ok()) << guarded.error;
  for (std::size_t c = 0; c < full.rig.controls.size(); ++c) {
    std::size_t hits = 0, blends = 0, misses = 0;
    double last = 0;
    const int steps = of_inner() ? 400 : 100;  // over a longer way
    for (int step = 0; step <= steps; ++step) {
      SCOPED_TRACE(testing::Message() << full.rig.controls[c].name << " " << step);
      std::vector<double> pose(full.rig.controls.size(), 0.0);
      pose[c] = (0.9 + (beyond() - 0.9) * step / steps) * full.rig.controls[c].max;
      for (RigRun* run : {&full, &pure, &guarded}) run->Pose(pose);
      const RunFrame frame = guarded.Evaluate();
      const std::vector<float> exact = full.Evaluate().points, reconstructed = pure.Evaluate().points;
      ASSERT_FALSE(SameBytes(exact, reconstructed));
      EXPECT_EQ(frame.hit, frame.full_weight == 0);
      EXPECT_EQ(frame.reason, frame.hit ? MissReason::kNone : MissReason::kOutOfRange);
      EXPECT_GE(frame.full_weight, last);  // farther out never less of it
      EXPECT_LE(frame.full_weight, 1);
      last = frame.full_weight;
      if (frame.full_weight == 1) {
        ++misses;
        EXPECT_TRUE(SameBytes(frame.points, exact));
        continue;
      }
      ++(frame.hit ? hits : blends);
      ExpectBlend(frame.points, reconstructed, exact, frame.full_weight);
    }
    EXPECT_GE(hits, 5u);
    EXPECT_GE(blends, 5u);
    EXPECT_GE(misses, 5u);
  }
}

TEST_P(KpsaFrames, DoNotDependOnWhatCameBefore) {
  const std::vector<RunFrame> expected = InOrder();
  EXPECT_FALSE(SameBytes(expected[0].points, expected[1].points));  // mixing them up would show
  std::vector<std::size_t> order(2 * poses_.size());                // every frame twice
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i % poses_.size();
  std::shuffle(order.begin(), order.end(), std::mt19937(3));
  RigRun run(kHello, {.subspace = mixed_});
  ASSERT_TRUE(run.ok()) << run.error;
  for (std::size_t f : order) {
    run.Pose(poses_[f]);
    const RunFrame frame = run.Evaluate();
    ASSERT_TRUE(SameBytes(frame.points, expected[f].points)) << f;
    ASSERT_EQ(frame.hit, expected[f].hit);
    ASSERT_EQ(frame.text, expected[f].text);
    ASSERT_TRUE(SameBytes(run.Evaluate().points, expected[f].points)) << f << " asked again";
  }
}

TEST_P(KpsaFrames, AnyThreadsBlocksAndOrderGiveTheSameBytes) {
  const std::vector<RunFrame> expected = InOrder();
  RigRun run(kHello, {.subspace = mixed_});
  ASSERT_TRUE(run.ok()) << run.error;
  std::vector<std::size_t> forward(poses_.size());
  std::iota(forward.begin(), forward.end(), 0u);
  std::vector<std::size_t> shuffled = forward;
  shuffled.insert(shuffled.end(), forward.rbegin(), forward.rend());
  std::shuffle(shuffled.begin(), shuffled.end(), std::mt19937(5));
  for (const auto& order : {forward, shuffled}) {
    for (const auto& [threads, block] : {std::pair{1, 1}, {1, 8}, {1, 5}, {2, 1}, {3, 4}, {4, 8}, {4, 64}}) {
      SCOPED_TRACE(testing::Message() << threads << " threads, blocks of " << block);
      FrameOptions options;
      options.threads = threads;
      options.block = block;
      std::size_t seen = 0, wrong = 0;
      const Status status = EvaluateFrames(
          run.plan, order.size(), options,
          [&](std::size_t f, Evaluator& evaluator) { run.Pose(poses_[order[f]], &evaluator); },
          [&](std::size_t f, const Evaluator& evaluator, const Status& evaluated) -> Status {
            if (!evaluated.ok()) return evaluated;
            const RunFrame frame = run.Frame(evaluator);
            wrong += !SameBytes(frame.points, expected[order[f]].points) ||
                     frame.hit != expected[order[f]].hit ||
                     std::memcmp(&frame.score, &expected[order[f]].score, sizeof(double)) != 0;
            ++seen;
            return Status();
          });
      EXPECT_TRUE(status.ok()) << status.ToString();
      EXPECT_EQ(seen, order.size());
      EXPECT_EQ(wrong, 0u);
    }
  }
  RigRun parallel(kHello, {.subspace = mixed_, .evaluator = {.parallel = true}});
  for (std::size_t f = 0; f < poses_.size(); ++f) {
    parallel.Pose(poses_[f]);
    ASSERT_TRUE(SameBytes(parallel.Evaluate().points, expected[f].points)) << f;
  }
}

// From a hit through the blend zone to a miss, slowly: what is emitted minus the exact points goes to nothing
// without a jump. With a zone of no width, it jumps by the whole error.
class KpsaBlendZone : public KpsaFrames {
};  // of points: the score of inner ones does not grow along the path

TEST_P(KpsaBlendZone, NothingPops) {
  // By SoftCache's own score, which grows along the path
  const auto trained = std::make_shared<Subspace>(*trained_);
  trained->score = ScoreMix();
  RigRun full(kHello), pure(kHello, {.subspace = trained, .accelerate = {.tolerance = kInfinity}});
  constexpr std::size_t kSteps = 1600;  // so slowly that the zone, where narrow, still takes dozens of them
  std::vector<std::vector<double>> path;
  std::vector<double> scores;
  for (std::size_t s = 0; s <= kSteps; ++s) {
    const double t = static_cast<double>(s) / kSteps;
    std::vector<double>& pose = path.emplace_back();
    for (const Control& control : full.rig.controls) pose.push_back(t * control.min);
    pure.Pose(pose);
    const RunFrame frame = pure.Evaluate();
    ASSERT_TRUE(frame.hit) << t << " " << frame.text;
    scores.push_back(frame.score);
  }
  // The zone lies where the path crosses it, from well below to well above
  const double lo = scores[2 * kSteps / 5], hi = scores[9 * kSteps / 10];
  ASSERT_LT(1.2 * lo, hi);
  pure.Pose(path[9 * kSteps / 10]);
  full.Pose(path[9 * kSteps / 10]);
  const double error_at_end = LargestDistance(pure.Evaluate().points, full.Evaluate().points);
  const auto largest_pop = [&](double tau_lo, double tau) {
    RigRun run(kHello, {.subspace = WithThreshold(*trained, tau_lo, tau)});
    std::vector<float> before;
    double pop = 0;
    std::size_t hits = 0, blends = 0;
    for (const std::vector<double>& pose : path) {
      run.Pose(pose);
      full.Pose(pose);
      const RunFrame frame = run.Evaluate();
      hits += frame.hit;
      blends += !frame.hit && frame.score < tau;
      std::vector<float> difference = full.Evaluate().points;
      for (std::size_t i = 0; i < difference.size(); ++i) difference[i] = frame.points[i] - difference[i];
      if (!before.empty()) pop = std::max(pop, LargestDistance(before, difference));
      before = difference;
    }
    EXPECT_GT(hits, kSteps / 5);
    EXPECT_LT(hits + blends, kSteps);
    return pop;
  };
  const double soft = largest_pop(lo, hi), hard = largest_pop(0.999999 * hi, hi);
  EXPECT_LT(soft, 0.1 * error_at_end);
  EXPECT_GT(hard, 0.7 * error_at_end);
  EXPECT_GT(hard, 5 * soft);
}

TEST_P(KpsaFrames, ControlsBeyondTheirTrainedRangeMissByName) {
  RigRun run(kHello, {.subspace = WithGuardsOnly(*trained_)}), full(kHello);
  const std::vector<double> rest(run.rig.controls.size(), 0.0);
  for (std::size_t c = 0; c < run.rig.controls.size(); ++c) {
    for (const double share : {1.0, beyond()}) {
      std::vector<double> pose = rest;
      pose[c] = share * run.rig.controls[c].max;
      run.Pose(pose);
      full.Pose(pose);
      const RunFrame frame = run.Evaluate();
      if (share == 1.0) {
        EXPECT_TRUE(frame.hit) << frame.text;
        EXPECT_EQ(frame.text, "hit");
        continue;
      }
      EXPECT_FALSE(frame.hit);
      EXPECT_EQ(frame.full_weight, 1);
      EXPECT_EQ(frame.reason, MissReason::kOutOfRange);
      EXPECT_NE(frame.text.find("upper.matrix is outside its trained range"), std::string::npos)
          << frame.text;
      EXPECT_TRUE(SameBytes(frame.points, full.Evaluate().points));
    }
  }
}

TEST_P(KpsaFrames, AControlThatIsNoNumberMissesAndLeavesNothingBehind) {
  RigRun run(kHello, {.subspace = WithGuardsOnly(*trained_)});
  const std::vector<double> rest(run.rig.controls.size(), 0.0);
  run.Pose(rest);
  const RunFrame before = run.Evaluate();
  EXPECT_TRUE(before.hit);
  for (const double bad : {std::nan(""), kInfinity, -kInfinity}) {
    run.Set("upper.rotateX", bad);
    const RunFrame frame = run.Evaluate();
    EXPECT_FALSE(frame.hit);
    EXPECT_EQ(frame.reason, MissReason::kOutOfRange);
    EXPECT_NE(frame.text.find("upper.matrix"), std::string::npos) << frame.text;
    run.Pose(rest);
    const RunFrame after = run.Evaluate();
    EXPECT_TRUE(after.hit);
    EXPECT_TRUE(SameBytes(after.points, before.points));
  }
}

INSTANTIATE_TEST_SUITE_P(Reconstructs, KpsaBlendZone, ::testing::Values(TrainOptions::Inner::kNever),
                         [](const auto&) { return "Points"; });
INSTANTIATE_TEST_SUITE_P(Reconstructs, KpsaFrames,
                         ::testing::Values(TrainOptions::Inner::kNever, TrainOptions::Inner::kAlways),
                         [](const auto& of) {
                           return of.param == TrainOptions::Inner::kAlways ? "InnerPoints" : "Points";
                         });

}  // namespace
}  // namespace kpsa::engine
