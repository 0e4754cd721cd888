#include "kpsa/training/untold_controls.h"

#include <algorithm>
#include <span>
#include <utility>

#include "kpsa/training/calibrate_subspace.h"
#include "kpsa/training/pose_judge.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kOfEach = 48, kLeastOfEach = 8, kMostOfAll = 2400;  // poses, half of them at each end
constexpr double kShareUntold = 1.0 / 6;
constexpr std::size_t kFewestUntold = 2;
constexpr std::size_t kHeldTogether = 256;  // poses that are judged at a time
constexpr std::uint64_t kHeldSeed = 0x1f83d9abfb41bd6bull;

}  // namespace

Result<std::vector<std::size_t>> UntoldControls(TrainingSetup* setup, const CueSet& cues,
                                                const Subspace& subspace) {
  const std::vector<std::size_t> held = setup->sampler->held();
  std::vector<std::size_t> untold;
  if (held.empty() || setup->clips.empty()) return untold;
  const std::size_t each = std::clamp(kMostOfAll / held.size() / 4 * 4, kLeastOfEach, kOfEach);
  const SoftCacheThreshold threshold =
      Calibrate(subspace.calibration, subspace.tolerance, subspace.violation_rate, subspace.blend_start)
          .threshold;
  const std::vector<char> guarded = GuardedEntries(setup->guards, *setup->rig.graph, subspace.carried);
  PoseJudge judge(setup->rig, subspace, setup->layout, cues, false);
  const std::size_t together = std::max<std::size_t>(1, kHeldTogether / each);
  for (std::size_t first = 0; first < held.size(); first += together) {
    const std::span some = std::span(held).subspan(first, std::min(together, held.size() - first));
    std::vector<SampledPose> poses = setup->sampler->Alone(some, each, setup->options.seed ^ kHeldSeed);
    std::vector<std::size_t> order(poses.size());  // by clip, as the recorder writes them
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::ranges::stable_sort(order, {}, [&](std::size_t i) { return poses[i].clip; });
    PoseMatrix recorded(setup->layout);
    KPSA_RETURN_IF_ERROR(setup->recorder->AddSamples(poses, setup->clips, &recorded));
    std::vector<ScoreJudge> judges;
    for (const JudgedPose& pose : judge.Judge(recorded)) judges.push_back({pose});
    std::vector<std::vector<float>> entries;
    for (std::size_t t = 0; t < recorded.poses(); ++t) {
      const std::span<const float> row = std::as_const(recorded).row(t).subspan(setup->layout.scalar_begin());
      entries.emplace_back(row.begin(), row.end());
    }
    AskGuards(subspace.ranges, guarded, entries, subspace.patches.patches, &judges);
    JudgeBy(subspace.patches, &judges);
    const std::vector<CalibrationPair> pairs = PairsOf(subspace, judges);
    std::vector<std::size_t> wrong(2 * some.size(), 0);  // by end
    for (std::size_t t = 0; t < pairs.size(); ++t) {
      const std::size_t k = order[t] / each, c = some[k];
      const bool up = poses[order[t]].values[c] > setup->rig.controls[c].rest;
      wrong[2 * k + (up ? 1 : 0)] += IsWrong(pairs[t], threshold, subspace.tolerance);
    }
    const double most = kShareUntold * static_cast<double>(each) / 2;
    for (std::size_t k = 0; k < some.size(); ++k) {
      const std::size_t worst = std::max(wrong[2 * k], wrong[2 * k + 1]);
      if (worst >= kFewestUntold && static_cast<double>(worst) >= most) untold.push_back(some[k]);
    }
    KPSA_RETURN_IF_ERROR(setup->Say("held controls", 0.99));
  }
  return untold;
}

}  // namespace kpsa::engine
