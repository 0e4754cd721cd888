// Frames of which a part misses: that part is evaluated fully, goes over into what is reconstructed, and
// costs a part. On the bundled hello rig, with thresholds that make it happen.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "files/safetensors.h"
#include "graph/frames.h"
#include "tests/cli/hello_folder.h"
#include "tests/cli/process.h"
#include "tests/cli/rig_run.h"

namespace kpsa::engine {
namespace {

class LocalMisses : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    TrainOptions options = QuickTraining();
    options.without.trust = true;           // doubts as they are: thresholds among them make it happen
    options.may_have_cues_by_tile = false;  // nor fewer numbers than 300
    const std::shared_ptr<const Subspace> trained = TrainRig(kHello, options);
    ASSERT_NE(trained, nullptr);
    auto doubting = std::make_shared<Subspace>(*trained);
    ASSERT_GT(doubting->doubt_inputs(), 0u);
    doubting->score = {0, 1 / kQuickTolerance};
    pure_ = WithGuardsOnly(*doubting);
    RigRun run(kHello, {.subspace = pure_});
    ASSERT_TRUE(run.ok()) << run.error;
    poses_ = SmoothPoses(run.rig, 80, 0.95);
    std::vector<double> scores;
    for (const auto& pose : poses_) {
      run.Pose(pose);
      const RunFrame frame = run.Evaluate();
      ASSERT_TRUE(frame.hit) << frame.text;
      reconstructed_.push_back(frame.points);
      scores.push_back(frame.score);
    }
    std::sort(scores.begin(), scores.end());
    tau_ = scores[scores.size() / 2];
    cheap_ = WithPatches(*doubting, 0.02);
    dear_ = WithPatches(*doubting, 0.9);
    RigRun full(kHello);
    for (const auto& pose : poses_) {
      full.Pose(pose);
      exact_.push_back(full.Evaluate().points);
    }
  }
  static void TearDownTestSuite() {
    pure_.reset(), cheap_.reset(), dear_.reset();
    poses_.clear(), reconstructed_.clear(), exact_.clear();
  }
  static std::shared_ptr<const Subspace> WithPatches(const Subspace& subspace, double cost,
                                                     double share = 0.9) {
    auto copy = std::make_shared<Subspace>(*WithThreshold(subspace, 0.8 * tau_, tau_));
    copy->patches = MakePatchLayout(copy->tiles_of_outputs());
    for (const PatchRegion& region : copy->patches.regions)
      copy->patches.costs.push_back(cost * region.count);
    copy->patches.share = share;
    return copy;
  }
  static std::vector<RunFrame> Frames(const std::shared_ptr<const Subspace>& subspace) {
    RigRun run(kHello, {.subspace = subspace});
    EXPECT_TRUE(run.ok()) << run.error;
    std::vector<RunFrame> frames;
    for (const auto& pose : poses_) {
      run.Pose(pose);
      frames.push_back(run.Evaluate());
    }
    return frames;
  }
  // Of each patch, from its point that the two sides place farthest apart.
  static std::vector<double> WeightsOfPatches(const std::vector<float>& points, std::size_t f,
                                              std::span<const PatchPoints> patches) {
    std::vector<double> weights(patches.size());
    const std::size_t own = cheap_->patches.tiles * kTilePoints, count = points.size() / 3;
    for (std::size_t p = 0; p < patches.size(); ++p) {
      double farthest = 0;
      for (std::size_t i = p * own; i < std::min((p + 1) * own, count); ++i) {
        bool alone = true;
        for (std::size_t q = 0; q < patches.size(); ++q)
          alone = alone && (q == p || !std::ranges::binary_search(patches[q].points, static_cast<Index>(i)));
        for (std::size_t a = 0; a < 3 && alone; ++a) {
          const double apart = static_cast<double>(At(exact_[f], i, a)) - At(reconstructed_[f], i, a);
          if (std::fabs(apart) <= farthest) continue;
          farthest = std::fabs(apart);
          weights[p] = (static_cast<double>(At(points, i, a)) - At(reconstructed_[f], i, a)) / apart;
        }
      }
    }
    return weights;
  }
  static float At(const std::vector<float>& points, std::size_t i, std::size_t axis) {
    return points[axis * (points.size() / 3) + i];
  }

  static inline std::shared_ptr<const Subspace> pure_, cheap_, dear_;
  static inline std::vector<std::vector<double>> poses_;
  static inline std::vector<std::vector<float>> reconstructed_, exact_;
  static inline double tau_ = 0;
};

TEST_F(LocalMisses, PatchesAreExactAndTheRestIsReconstructed) {
  const std::vector<RunFrame> frames = Frames(cheap_);
  RigRun run(kHello, {.subspace = cheap_});
  const std::vector<PatchPoints>& patches = run.accelerated.config->data().patches;
  ASSERT_EQ(patches.size(), cheap_->patches.patches);
  ASSERT_GE(patches.size(), 4u);
  // How much of each point the patches take together
  std::size_t local = 0, hits = 0, whole = 0, exact_patches = 0;
  for (std::size_t f = 0; f < frames.size(); ++f) {
    SCOPED_TRACE(f);
    const RunFrame& frame = frames[f];
    if (frame.hit) {
      ++hits;
      EXPECT_TRUE(SameBytes(frame.points, reconstructed_[f]));
      continue;
    }
    EXPECT_EQ(frame.reason, MissReason::kDoubt);
    if (frame.full_weight == 1) {
      ++whole;
      EXPECT_TRUE(SameBytes(frame.points, exact_[f]));
      continue;
    }
    const std::vector<double> weights = WeightsOfPatches(frame.points, f, patches);
    const std::size_t own = cheap_->patches.tiles * kTilePoints, count = frame.points.size() / 3;
    const double largest = *std::ranges::max_element(weights), mean = frame.full_weight;
    if (largest < 0.01 || mean > kWholeFrom) continue;  // hardly a miss; or one of all points, too
    ++local;
    for (std::size_t i = 0; i < count; ++i) {
      double rest = 1;
      for (std::size_t p = 0; p < patches.size(); ++p) {
        const auto at = std::ranges::lower_bound(patches[p].points, static_cast<Index>(i));
        if (at != patches[p].points.end() && *at == i)
          rest *= 1 - weights[p] *
                          static_cast<double>(
                              patches[p].weights[static_cast<std::size_t>(at - patches[p].points.begin())]);
      }
      for (std::size_t a = 0; a < 3; ++a) {
        const double from = At(reconstructed_[f], i, a), to = At(exact_[f], i, a);
        ASSERT_NEAR(At(frame.points, i, a), to + rest * (from - to), 2e-2 * std::fabs(to - from) + 2e-7) << i;
      }
    }
    for (std::size_t p = 0; p < patches.size(); ++p) {
      if (weights[p] < 1) continue;
      ++exact_patches;
      for (std::size_t i = p * own; i < std::min((p + 1) * own, count); ++i) {
        for (std::size_t a = 0; a < 3; ++a)
          ASSERT_EQ(At(frame.points, i, a), At(exact_[f], i, a)) << "bit for bit";
      }
    }
  }
  EXPECT_GT(hits, 15u);
  EXPECT_GT(local, 10u);
  EXPECT_GT(exact_patches, 5u);
}

TEST_F(LocalMisses, DoNotDependOnWhatTheFullEvaluationIsAPartOf) {
  const std::vector<RunFrame> of_regions = Frames(cheap_), of_all = Frames(dear_);
  std::size_t partly = 0;
  for (std::size_t f = 0; f < poses_.size(); ++f) {
    EXPECT_TRUE(SameBytes(of_regions[f].points, of_all[f].points)) << f;
    EXPECT_EQ(of_regions[f].full_weight, of_all[f].full_weight);
    partly += of_regions[f].full_weight > 0 && of_regions[f].full_weight < kWholeFrom;
  }
  EXPECT_GT(partly, 10u);
}

// Misses of all points, whose blends leave alone what is hardly doubted.
TEST_F(LocalMisses, InBlendsOnlyAreMissesOfAllPointsElsewhere) {
  const auto whole = WithThreshold(*pure_, 0.8 * tau_, tau_);
  auto in_blends = std::make_shared<Subspace>(*cheap_);
  in_blends->patches.blends_only = true;
  ASSERT_TRUE(ValidateSubspace(*in_blends).ok()) << ValidateSubspace(*in_blends).ToString();
  const std::vector<RunFrame> frames = Frames(in_blends), of_all = Frames(whole);
  std::size_t hits = 0, misses = 0, spared = 0;
  for (std::size_t f = 0; f < frames.size(); ++f) {
    SCOPED_TRACE(f);
    EXPECT_EQ(frames[f].hit, of_all[f].hit);
    EXPECT_EQ(frames[f].score, of_all[f].score);
    EXPECT_GE(frames[f].full_weight == 1, of_all[f].full_weight == 1);
    hits += frames[f].hit, misses += frames[f].full_weight == 1;
    if (frames[f].hit || frames[f].full_weight == 1) {
      EXPECT_TRUE(SameBytes(frames[f].points, frames[f].hit ? reconstructed_[f] : exact_[f]));
      continue;
    }
    const std::size_t count = frames[f].points.size() / 3;
    std::size_t alone = 0;
    for (std::size_t i = 0; i < count; ++i) {
      bool same = true;
      for (std::size_t a = 0; a < 3; ++a) {
        const float from = At(reconstructed_[f], i, a), at = At(frames[f].points, i, a);
        same = same && at == from;
        ASSERT_LE(std::fabs(at - from), std::fabs(At(exact_[f], i, a) - from) + 2e-7f) << i;
      }
      alone += same;
    }
    spared += alone > count / 4;
  }
  EXPECT_GT(hits, 15u);
  EXPECT_GT(misses, 10u);
  EXPECT_GT(spared, 3u) << "of blends";
}

// Points that the full side of the mush has computed, which is what a miss costs most.
std::uint64_t MushedPoints(const RigRun& run) {
  std::uint64_t points = 0;
  for (Index s = 0; s < run.plan->steps().size(); ++s) {
    if (std::string_view("mush") == run.plan->step_name(s) && run.plan->infos()[s].segment != 0)
      points += run.profile->counts()[s] * run.plan->infos()[s].points;
  }
  return points;
}

TEST_F(LocalMisses, CostAPart) {
  std::size_t compared = 0;
  for (std::size_t f = 0; f < poses_.size(); ++f) {
    RigRun part(kHello, {.subspace = cheap_}), whole(kHello, {.subspace = dear_});
    for (RigRun* run : {&part, &whole}) run->Pose(poses_[f]);
    const RunFrame frame = part.Evaluate();
    whole.Evaluate();
    if (frame.hit) {
      EXPECT_EQ(MushedPoints(part), 0u);
      continue;
    }
    EXPECT_EQ(MushedPoints(whole), exact_[f].size() / 3);
    EXPECT_GT(MushedPoints(part), 0u);
    if (frame.full_weight > 1.0 / 7 + 1e-6) continue;  // one of seven patches, and of that alone
    const auto weights = WeightsOfPatches(frame.points, f, part.accelerated.config->data().patches);
    if (std::ranges::count_if(weights, [](double weight) { return weight > 1e-3; }) > 1) continue;
    ++compared;
    EXPECT_LE(2 * MushedPoints(part), MushedPoints(whole)) << f;
  }
  EXPECT_GT(compared, 5u);
}

TEST_F(LocalMisses, AnyOrderThreadsAndBlocksGiveTheSameBytes) {
  const std::vector<RunFrame> expected = Frames(cheap_);
  RigRun run(kHello, {.subspace = cheap_});
  std::vector<std::size_t> order(2 * poses_.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i % poses_.size();
  std::shuffle(order.begin(), order.end(), std::mt19937(4));
  for (const auto& [threads, block] : {std::pair{1, 1}, {1, 8}, {2, 5}, {4, 8}}) {
    FrameOptions options;
    options.threads = threads, options.block = block;
    std::size_t wrong = 0, seen = 0;
    const Status status = EvaluateFrames(
        run.plan, order.size(), options,
        [&](std::size_t f, Evaluator& evaluator) { run.Pose(poses_[order[f]], &evaluator); },
        [&](std::size_t f, const Evaluator& evaluator, const Status& evaluated) -> Status {
          if (!evaluated.ok()) return evaluated;
          wrong += !SameBytes(run.Frame(evaluator).points, expected[order[f]].points);
          ++seen;
          return Status();
        });
    EXPECT_TRUE(status.ok()) << status.ToString();
    EXPECT_EQ(seen, order.size());
    EXPECT_EQ(wrong, 0u) << threads << " threads, blocks of " << block;
  }
  RigRun parallel(kHello, {.subspace = cheap_, .evaluator = {.parallel = true}});
  for (const std::size_t f : order) {
    parallel.Pose(poses_[f]);
    ASSERT_TRUE(SameBytes(parallel.Evaluate().points, expected[f].points)) << f;
  }
}

// A value outside its range is a miss of the patches that it speaks of, and of no others.
TEST_F(LocalMisses, AreWhatAGuardOfSomePatchesAsksFor) {
  auto guarded = std::make_shared<Subspace>(*cheap_);
  TrainedRange& range =
      *std::ranges::max_element(guarded->ranges, {}, [](const TrainedRange& one) { return one.hi - one.lo; });
  constexpr std::size_t kPatch = 2;
  range.hi = range.lo + 0.4 * (range.hi - range.lo), range.ramp = (range.hi - range.lo) / 20;
  auto of_all = std::make_shared<Subspace>(*guarded);
  for (TrainedRange& one : guarded->ranges) one.patches = std::uint64_t{1} << kPatch;
  const std::vector<RunFrame> frames = Frames(guarded), whole = Frames(of_all), before = Frames(cheap_);
  RigRun run(kHello, {.subspace = guarded});
  const PatchPoints& patch = run.accelerated.config->data().patches[kPatch];
  const std::size_t own = guarded->patches.tiles * kTilePoints;
  std::size_t exact = 0, blended = 0;
  for (std::size_t f = 0; f < frames.size(); ++f) {
    SCOPED_TRACE(f);
    if (!before[f].hit) continue;  // what its doubts ask for is told apart elsewhere
    if (whole[f].hit) {
      EXPECT_TRUE(frames[f].hit);
      continue;
    }
    EXPECT_FALSE(frames[f].hit);
    EXPECT_EQ(frames[f].reason, MissReason::kOutOfRange);
    EXPECT_EQ(frames[f].text, whole[f].text) << "the same guard";
    EXPECT_LE(frames[f].full_weight, 1.0 / static_cast<double>(guarded->patches.patches) + 1e-6);
    const bool full = whole[f].full_weight == 1;
    exact += full, blended += !full;
    for (std::size_t i = 0; i < frames[f].points.size() / 3; ++i) {
      const bool reached = std::ranges::binary_search(patch.points, static_cast<Index>(i));
      for (std::size_t a = 0; a < 3; ++a) {
        if (!reached) {
          ASSERT_EQ(At(frames[f].points, i, a), At(reconstructed_[f], i, a)) << i;
        } else if (full && i / own == kPatch) {
          ASSERT_EQ(At(frames[f].points, i, a), At(exact_[f], i, a)) << i;
        }
      }
    }
  }
  EXPECT_GT(exact, 5u);
  EXPECT_GT(exact + blended, 8u);
  // And the full side computes a part
  for (std::size_t f = 0; f < poses_.size(); ++f) {
    if (!before[f].hit || frames[f].hit) continue;
    RigRun part(kHello, {.subspace = guarded});
    part.Pose(poses_[f]);
    part.Evaluate();
    EXPECT_GT(MushedPoints(part), 0u);
    EXPECT_LT(2 * MushedPoints(part), exact_[f].size() / 3);
    break;
  }
}

// Neighbours differ in how far they are off by no more than the border's slope takes away from that, besides
// what the reconstruction alone has there.
TEST_F(LocalMisses, HaveNoSeam) {
  const std::vector<RunFrame> frames = Frames(cheap_);
  RigRun rest(kHello);
  const std::vector<float> at = rest.Evaluate().points;
  const std::size_t count = at.size() / 3;
  const auto distance = [&](const std::vector<float>& p, const std::vector<float>& q, std::size_t i,
                            std::size_t j, bool difference) {
    double squared = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      const double d = difference ? (static_cast<double>(At(p, i, a)) - At(q, i, a)) -
                                        (static_cast<double>(At(p, j, a)) - At(q, j, a))
                                  : static_cast<double>(At(p, i, a)) - At(q, j, a);
      squared += d * d;
    }
    return std::sqrt(squared);
  };
  // Each point's nearest neighbours
  std::vector<std::pair<std::size_t, std::size_t>> edges;
  for (std::size_t i = 0; i < count; ++i) {
    double nearest = kInfinity;
    for (std::size_t j = 0; j < count; ++j) {
      if (j != i) nearest = std::min(nearest, distance(at, at, i, j, false));
    }
    for (std::size_t j = 0; j < i; ++j) {
      if (distance(at, at, i, j, false) <= 1.01 * nearest) edges.emplace_back(i, j);
    }
  }
  ASSERT_GT(edges.size(), count / 3);
  std::size_t local = 0;
  double steepest = 0;
  for (std::size_t f = 0; f < frames.size(); ++f) {
    if (frames[f].hit || frames[f].full_weight > kWholeFrom) continue;
    ++local;
    double largest = 0;
    for (std::size_t i = 0; i < count; ++i)
      largest = std::max(largest, distance(reconstructed_[f], exact_[f], i, i, false));
    for (const auto& [i, j] : edges) {
      const double jump = distance(frames[f].points, exact_[f], i, j, true),
                   own = distance(reconstructed_[f], exact_[f], i, j, true);
      EXPECT_LE(jump, own + 0.55 * largest) << f;
      steepest = std::max(steepest, (jump - own) / largest);
    }
  }
  EXPECT_GT(local, 10u);
  EXPECT_GT(steepest, 0.02) << "there is a border";
}

TEST_F(LocalMisses, NothingPopsOnTheWay) {
  RigRun run(kHello, {.subspace = cheap_}), pure(kHello, {.subspace = pure_}), full(kHello);
  constexpr int kSteps = 600;
  std::vector<float> before;
  double pop = 0, largest = 0;
  std::size_t partly = 0, hits = 0;
  for (int s = 0; s <= kSteps; ++s) {
    std::vector<double> pose;
    const double t = static_cast<double>(s) / kSteps;
    for (const Control& control : full.rig.controls) pose.push_back(0.95 * t * control.min);
    for (RigRun* one : {&run, &pure, &full}) one->Pose(pose);
    const RunFrame frame = run.Evaluate();
    hits += frame.hit, partly += !frame.hit && frame.full_weight < kWholeFrom;
    std::vector<float> off = full.Evaluate().points;
    largest = std::max(largest, LargestDistance(off, pure.Evaluate().points));
    for (std::size_t i = 0; i < off.size(); ++i) off[i] = frame.points[i] - off[i];
    if (!before.empty()) pop = std::max(pop, LargestDistance(before, off));
    before = off;
  }
  EXPECT_GT(hits, 20u);
  EXPECT_GT(partly, 20u);
  EXPECT_LT(pop, 0.3 * largest);
}

TEST_F(LocalMisses, OnlySomePointsMayBeAskedFor) {
  RigRun run(kHello, {.subspace = cheap_});
  const std::vector<RunFrame> expected = Frames(cheap_);
  const auto total = static_cast<Index>(exact_[0].size() / 3);
  std::vector<Index> some;
  for (Index i = 3; i < total; i += 29) some.push_back(i);
  Request request;
  request.varying = VaryingPlugs(run.rig);
  const NodeDef& def = run.rig.graph->def(run.accelerated.node);
  request.outputs.push_back(
      {{run.accelerated.node, def.FindAttribute("outPoints"), 0, -1}, PointSet::Of(some, total)});
  const auto plan = run.compiler.Compile(*run.rig.graph, request);
  ASSERT_TRUE(plan.ok()) << plan.status().ToString();
  Evaluator evaluator(*plan);
  for (std::size_t f = 0; f < poses_.size(); ++f) {
    for (std::size_t c = 0; c < run.rig.controls.size(); ++c) {
      const PlugRef& control = run.rig.controls[c].plug;
      const Index varying = (*plan)->FindVarying(control);
      if (varying != kNoIndex)
        evaluator.Set(varying, poses_[f][c],
                      (*plan)->varying()[varying].type == Type::kDouble3 ? control.component : -1);
    }
    ASSERT_TRUE(evaluator.Evaluate().ok());
    const ConstPointsView points = evaluator.Points(0);
    for (std::size_t i = 0; i < some.size(); ++i) {
      ASSERT_EQ(points.x[i], At(expected[f].points, some[i], 0)) << f;
      ASSERT_EQ(points.z[i], At(expected[f].points, some[i], 2)) << f;
    }
  }
}

TEST_F(LocalMisses, AFileKeepsThemAndDamageIsRefused) {
  TemporaryFolder folder;
  auto held = std::make_shared<Subspace>(*cheap_);
  held->calibration[3].patches = {{0.1, 1e-4}, {0.4, 2e-4, 0.25}};
  held->calibration[3].middle = 0.05;
  held->calibration[7].patches = {{0.2, 3e-4}};
  held->patches.costs[2] = 0.125;
  held->ranges[1].patches = 0b101;
  const std::string path = folder / "held.kpsa";
  ASSERT_TRUE(WriteSubspace(*held, path).ok());
  const Result<Subspace> read = ReadSubspace(path);
  ASSERT_TRUE(read.ok()) << read.status().ToString();
  EXPECT_EQ(read->patches, held->patches);
  for (std::size_t r = 0; r < held->ranges.size(); ++r)
    EXPECT_EQ(read->ranges[r].patches, held->ranges[r].patches) << r;
  for (std::size_t i = 0; i < held->calibration.size(); ++i) {
    EXPECT_EQ(read->calibration[i].patches, held->calibration[i].patches);
    EXPECT_EQ(read->calibration[i].middle, held->calibration[i].middle);
  }
  EXPECT_FALSE(read->calibration[3].blends_only);
  auto in_blends = std::make_shared<Subspace>(*held);
  in_blends->patches.blends_only = true;
  ASSERT_TRUE(WriteSubspace(*in_blends, folder / "blends.kpsa").ok());
  const Result<Subspace> blends = ReadSubspace(folder / "blends.kpsa");
  ASSERT_TRUE(blends.ok()) << blends.status().ToString();
  EXPECT_EQ(blends->patches, in_blends->patches);
  EXPECT_TRUE(blends->calibration[3].blends_only);
  EXPECT_EQ(*SafetensorsFile::Read(folder / "blends.kpsa")->Metadata("version"),
            std::to_string(kBlendsVersion));
  const auto refused = [&](const auto& damage, const char* word) {
    Subspace damaged = *held;
    damage(&damaged);
    const Status status = ValidateSubspace(damaged);
    EXPECT_FALSE(status.ok()) << word;
    EXPECT_NE(status.ToString().find(word), std::string::npos) << status.ToString();
  };
  refused([](Subspace* s) { ++s->patches.tiles; }, "patches");
  refused([](Subspace* s) { s->patches.costs.pop_back(); }, "costs");
  refused([](Subspace* s) { s->patches.costs[0] = -1; }, "costs");
  refused([](Subspace* s) { s->patches.costs[0] = std::nan(""); }, "costs");
  refused([](Subspace* s) { s->patches.regions[1].first = 99; }, "patches");
  refused([](Subspace* s) { s->patches.share = 0; }, "share");
  refused([](Subspace* s) { s->ranges[1].patches = std::uint64_t{1} << s->patches.patches; },
          "speaks of patches");
  refused([](Subspace* s) { s->score = {1, 0}; }, "doubts");
  refused([](Subspace* s) { s->calibration[3].patches[1].error = -1; }, "patch");
  refused([](Subspace* s) { s->calibration[3].middle = std::nan(""); }, "half");
  // Bytes of the file: every tensor and number of the patches is looked at, or the digest is
  std::string bytes = folder.Read(path);
  for (const char* name : {"patchCosts", "calibrationPatches", "tilesOfPatch", "patchShare"}) {
    std::string other = bytes;
    const std::size_t at = other.find(name);
    ASSERT_NE(at, std::string::npos) << name;
    other[at] = 'X';
    folder.Write("other.kpsa", other);
    EXPECT_FALSE(ReadSubspace(folder / "other.kpsa").ok()) << name;
  }
}

}  // namespace
}  // namespace kpsa::engine
