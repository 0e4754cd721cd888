#include "kpsa/training/calibrate_subspace.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "kpsa/activity.h"
#include "kpsa/binomial.h"
#include "kpsa/training/carried.h"
#include "kpsa/training/guard_parts.h"
#include "kpsa/training/pose_judge.h"
#include "kpsa/training/range_margins.h"
#include "kpsa/training/separation.h"
#include "kpsa/training/tile_trust.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kPosesAtOnce = 256;                      // are held
constexpr std::size_t kTrialSweeps = 120, kTrialSamples = 30;  // poses that say what carries the points
constexpr double kAsGood = 1.02;  // in cost: wider margins are taken, since clips may go farther
constexpr double kJudging = 1.5;  // that a pose is judged, in the time that it took to train on
constexpr double kSpared = 1.5;   // of the fewest poses that could promise a rate
constexpr double kTrying = 300;   // poses that the caller evaluates when all is done, about
constexpr int kBeyond = static_cast<int>(PoseKind::kBeyond);
constexpr std::uint64_t kCalibrationSeed = 0x5deece66dull, kScoreSeed = 0x3c6ef372fe94f82bull,
                        kTrialSeed = 0x6a09e667f3bcc908ull, kManySeed = 0xa54ff53a5f1d36f1ull;
constexpr std::size_t kMostWithMany = 400;  // poses with many controls far out
constexpr double kBeyondPlayed = 1.25;      // of the activity of what was played: clips go a little farther
constexpr int kMixtures = static_cast<int>(PoseKind::kMixture);

// Judged poses of every kind.
struct JudgedSet {
  std::vector<ScoreJudge> judges;
  std::vector<std::vector<float>> entries;  // of the signals, by pose
  std::vector<SampledPose> poses;
};

// What carries the points rigidly is tried at a few poses.
Result<Carried> TryCarried(const Calibrator& of, const CalibrationWork& work) {
  std::vector<SampledPose> sweeps = work.sampler->SweepsWithTilts(), trial;
  const std::size_t count = std::min(kTrialSweeps, sweeps.size());
  for (std::size_t i = 0; i < count; ++i) trial.push_back(sweeps[i * sweeps.size() / count]);
  for (SampledPose& pose : work.sampler->Of(PoseKind::kSampled, kTrialSamples, of.options.seed ^ kTrialSeed))
    trial.push_back(std::move(pose));
  return FindCarried(of.rig, work.compiler, of.clips, trial, of.inverse_rest_stretch, of.diagonal,
                     of.options.tolerance);
}

// A few at a time. widen: the ranges hold them.
Status JudgeDrawn(const Calibrator& of, const CalibrationWork& work, std::span<const SampledPose> drawn,
                  int kind, bool widen, PoseJudge* judge, JudgedSet* judged) {
  for (std::size_t first = 0; first < drawn.size(); first += kPosesAtOnce) {
    // By clip, as the recorder writes them
    std::vector<SampledPose> some(
        drawn.begin() + static_cast<std::ptrdiff_t>(first),
        drawn.begin() + static_cast<std::ptrdiff_t>(std::min(first + kPosesAtOnce, drawn.size())));
    std::ranges::stable_sort(some, {}, &SampledPose::clip);
    PoseMatrix recorded(of.layout);
    KPSA_RETURN_IF_ERROR(work.recorder->AddSamples(some, of.clips, &recorded));
    for (const JudgedPose& pose : judge->Judge(recorded)) judged->judges.push_back({pose, 0, kind});
    for (std::size_t t = 0; t < recorded.poses(); ++t) {
      const std::span<const float> row = std::as_const(recorded).row(t).subspan(of.layout.scalar_begin());
      if (widen) work.ranges->Widen(row);
      judged->entries.emplace_back(row.begin(), row.end());
    }
    judged->poses.insert(judged->poses.end(), some.begin(), some.end());
  }
  return Status();
}

// New poses of a kind. All but those beyond the ranges widen these.
Status JudgePoses(const Calibrator& of, const CalibrationWork& work, int kind, std::uint64_t seed,
                  std::span<const double> margins, PoseJudge* judge, JudgedSet* judged) {
  const std::vector<SampledPose> drawn =
      work.sampler->Of(static_cast<PoseKind>(kind), of.size.poses,
                       (of.options.seed + static_cast<std::uint64_t>(kind)) ^ seed, margins);
  return JudgeDrawn(of, work, drawn, kind, kind != kBeyond, judge, judged);
}

// All scalars at rest.
Result<std::vector<float>> RestScalars(const Calibrator& of, const CalibrationWork& work) {
  if (of.rig.target.colors) return std::vector<float>();
  SampledPose rest;
  for (const ControlRange& control : of.rig.controls) rest.values.push_back(control.rest);
  PoseMatrix recorded(of.layout);
  KPSA_RETURN_IF_ERROR(work.recorder->AddSamples({rest}, of.clips, &recorded));
  const std::span<const float> row = std::as_const(recorded).row(0).subspan(of.layout.scalar_begin());
  return std::vector<float>(row.begin(), row.end());
}

// A range speaks of the patches that need what it watches, where patches miss by themselves.
Status GuardPatches(const Calibrator& of, const CalibrationWork& work, Subspace* subspace) {
  if (subspace->patches.tiles == 0) return Status();
  const Result<std::vector<std::uint64_t>> patches = FindGuardedPatches(
      of.rig, work.compiler, of.clips, work.recorder->signals(), of.guards.size(), *subspace);
  if (!patches.ok()) return patches.status();
  auto range = subspace->ranges.begin();
  for (std::size_t s = 0; s < of.guards.size(); ++s) {
    for (std::size_t e = 0; e < of.guards[s].entries(); ++e) (range++)->patches = (*patches)[s];
  }
  return Status();
}

// A subspace with ranges, and with the score that is best for these.
struct Guarded {
  Subspace subspace;
  ChosenMisses chosen;  // nothing where there are no judges
};
// judged: poses within the ranges; those beyond come from here. outside: of FoundMargins.
Result<Guarded> Guard(const Calibrator& of, const CalibrationWork& work, const RangeMargins& margins,
                      const std::vector<char>& guarded, std::span<const float> rest, const Subspace& subspace,
                      PoseJudge* judge, JudgedSet judged, JudgedSet outside) {
  KPSA_RETURN_IF_ERROR(of.rig.set_clip(std::nullopt));
  RangeFinder finder = *work.ranges;
  for (const std::vector<float>& entries : margins.entries) finder.Widen(entries);
  Result<std::vector<TrainedRange>> ranges =
      finder.Make(of.rig, work.compiler, of.guards,
                  {of.options.tolerance, of.options.range_ramp, of.diagonal, of.inverse_rest_stretch, rest});
  if (!ranges.ok()) return ranges.status();
  Guarded result{subspace, {}};
  result.subspace.ranges = std::move(*ranges);
  for (std::size_t e = 0; e < guarded.size(); ++e) {
    if (!guarded[e]) result.subspace.ranges[e].reach = 0;
  }
  KPSA_RETURN_IF_ERROR(GuardPatches(of, work, &result.subspace));
  if (judged.judges.empty()) return result;
  KPSA_RETURN_IF_ERROR(JudgePoses(of, work, kBeyond, kScoreSeed, margins.of_controls, judge, &judged));
  AskGuards(result.subspace.ranges, guarded, judged.entries, result.subspace.patches.patches, &judged.judges);
  AskGuards(result.subspace.ranges, guarded, outside.entries, result.subspace.patches.patches,
            &outside.judges);
  result.chosen = ChooseMisses(&result.subspace, judged.judges, 0, of.full_cost,
                               kCautious * of.options.tolerance, kCalibrationConfidence, outside.judges);
  return result;
}

// A guarded subspace with the poses that say what its threshold is.
struct Calibrated {
  Subspace subspace;
  JudgedSet judged;
  TrainingRecord::Separation separation;
  Calibration calibration;
  double missed = 0;  // of the poses within the ranges, all kinds alike, as ExpectedCost counts them
  std::optional<double> lost_of_clips = {};
};
Calibrated CalibrateWith(const Calibrator& of, const Guarded& guarded, const std::vector<char>& entries,
                         std::size_t patches, JudgedSet judged) {
  Calibrated result{guarded.subspace, std::move(judged), {}, {}, 0, {}};
  Subspace& subspace = result.subspace;
  std::vector<ScoreJudge>& judges = result.judged.judges;
  AskGuards(subspace.ranges, entries, result.judged.entries, patches, &judges);
  result.separation = SeparationOf(judges, subspace.tolerance);
  if (guarded.chosen.tried.empty()) subspace.score = ScoreOf(subspace, {}, of.full_cost);
  AsChosen(guarded.chosen, subspace, &judges);
  if (!guarded.chosen.trust.empty()) WeighTiles(guarded.chosen.trust, &subspace);
  if (subspace.patches.tiles == 0 || subspace.patches.blends_only) {
    for (TrainedRange& range : subspace.ranges) range.patches = kAllPatches;
  }
  subspace.calibration = PairsOf(subspace, judges);
  double missed[kPoseKinds] = {}, poses[kPoseKinds] = {};
  for (std::size_t i = 0; i < judges.size(); ++i) {
    const SampledPose& pose = result.judged.poses[i];
    subspace.calibration[i].near_clips = pose.near_clips && pose.kind == PoseKind::kSampled;
  }
  result.calibration =
      Calibrate(subspace.calibration, subspace.tolerance, subspace.violation_rate, subspace.blend_start);
  for (const ScoreJudge& judge : judges) {
    missed[judge.kind] += ShareOfFull(judge, subspace.score, result.calibration.threshold, subspace.patches);
    poses[judge.kind] += 1;
  }
  result.lost_of_clips = LostOfClips(subspace, judges, result.calibration.threshold);
  int kinds = 0;
  for (int kind = 0; kind < kPoseKinds; ++kind) {
    if (kind == kBeyond || poses[kind] == 0) continue;
    result.missed += missed[kind] / poses[kind], ++kinds;
  }
  result.missed /= std::max(kinds, 1);
  return result;
}

// Where poses with many controls far out hit and are wrong, more often than is promised of a kind, activity is limited to
// what frames are like. The subspace has its ranges and its calibration, which is of `judged`.
Status LimitActivity(const Calibrator& of, const CalibrationWork& work, const std::vector<char>& guarded,
                     const SoftCacheThreshold& threshold, const JudgedSet& judged, PoseJudge* judge,
                     Subspace* subspace) {
  std::vector<SampledPose> drawn = PosesWithMany(
      work.sampler->drawn(), std::min(of.size.poses, kMostWithMany), of.options.seed ^ kManySeed);
  for (SampledPose& pose : drawn) {  // tilts rest
    for (std::size_t c = pose.values.size(); c < of.rig.controls.size(); ++c)
      pose.values.push_back(of.rig.controls[c].rest);
  }
  JudgedSet many;
  KPSA_RETURN_IF_ERROR(JudgeDrawn(of, work, drawn, kMixtures, false, judge, &many));
  AskGuards(subspace->ranges, guarded, many.entries, subspace->patches.patches, &many.judges);
  const std::vector<CalibrationPair> pairs = PairsOf(*subspace, many.judges);
  const auto wrong = static_cast<std::size_t>(std::ranges::count_if(
      pairs, [&](const CalibrationPair& pair) { return IsWrong(pair, threshold, subspace->tolerance); }));
  const double promised =
      std::max(subspace->violation_rate, BinomialUpperBound(0, pairs.size(), kCalibrationConfidence));
  if (BinomialUpperBound(wrong, pairs.size(), kCalibrationConfidence) <= promised) return Status();
  std::vector<std::size_t> entries_of;
  for (const Signal& signal : of.guards) entries_of.push_back(signal.entries());
  double played = 0;
  const auto play = [&](std::span<const float> entries) {
    played = std::max(played, Activity(subspace->ranges, entries_of, entries));
  };
  for (const std::vector<float>& entries : work.ranges->played()) play(entries);
  for (std::size_t i = 0; i < judged.poses.size(); ++i) {
    if (judged.poses[i].kind != PoseKind::kBeyond) play(judged.entries[i]);
  }
  if (played > 0) subspace->activity_limit = kBeyondPlayed * played;
  return Status();
}

std::string RuleName(const MissRule& rule, const RangeMargins& margins) {
  std::string name = rule.score.doubt == 0      ? "likeness to the trained poses"
                     : rule.score.measured == 0 ? "doubts of tiles"
                                                : "likeness and doubts of tiles";
  if (rule.weighs && rule.score.doubt > 0) name += " (weighed)";
  name += rule.in_blends   ? fmt::format(", all points at once, in blends parts of {} tiles", rule.tiles)
          : rule.tiles > 0 ? fmt::format(", parts of {} tiles", rule.tiles)
                           : ", all points at once";
  const auto wider = std::ranges::count_if(margins.of_controls, [](double margin) { return margin > 0; });
  if (wider > 0) name += fmt::format(", {} of {} ranges widened", wider, margins.of_controls.size());
  return name;
}

// Of margins that were taken all that was tried, of others the best.
std::vector<TrainingRecord::Rule> TriedRules(const ChosenMisses& chosen, const RangeMargins& margins,
                                             double full, bool all) {
  std::vector<TrainingRecord::Rule> rules;
  if (!(full > 0)) return rules;  // the paper's way: nothing was priced
  for (std::size_t r = 0; r < chosen.tried.size(); ++r) {
    const MissRule& rule = chosen.tried[r];
    if (rule.weighs && rule.score.doubt == 0 && r != chosen.taken)
      continue;  // weighs nothing: the same again
    if (all || r == chosen.taken)
      rules.push_back({RuleName(rule, margins), rule.cost.misses, rule.cost.with_outside() / full,
                       all && r == chosen.taken});
  }
  return rules;
}

void RecordWorst(const Calibrator& of, const SampledPose& pose, double error, TrainingRecord* record) {
  record->worst.error = error;
  record->worst.kind = PoseKindName(pose.kind);
  for (std::size_t c = 0; c < of.rig.controls.size(); ++c) {
    const ControlRange& control = of.rig.controls[c];
    if (pose.values[c] != control.rest && !(pose.clip >= 0 && control.by_clip))
      record->worst.controls.emplace_back(of.rig.graph->PlugName(control.plug), pose.values[c]);
  }
  if (pose.clip < 0) return;
  const TrainingClip& clip = of.clips[static_cast<std::size_t>(pose.clip)];
  record->worst.clip = clip.name;
  record->worst.time = clip.times.front() + pose.phase * (clip.times.back() - clip.times.front());
}

double Rate(const TrainOptions& options) { return std::clamp(options.violation_rate, 1e-4, 0.5); }
// Of a kind: what the rate asks for, and the fewest that can promise it.
std::size_t WantedCalibrating(const TrainOptions& options) {
  return static_cast<std::size_t>(std::clamp(8.0 / Rate(options), 400.0, 1000.0));
}
std::size_t FewestCalibrating(const TrainOptions& options) {
  const double fewest = kSpared * std::log(1 - kCalibrationConfidence) / std::log1p(-Rate(options));
  return std::min(WantedCalibrating(options), static_cast<std::size_t>(std::ceil(fewest)));
}

}  // namespace

double LeastCalibrationSeconds(double pose_seconds, const TrainOptions& options) {
  const std::size_t each =
      options.calibration_poses > 0 ? options.calibration_poses : FewestCalibrating(options);
  return pose_seconds * (2 * kPoseKinds * kJudging * static_cast<double>(each) + kTrying);
}

CalibrationSize CalibrationWithin(double pose_seconds, const TrainOptions& options, TimeLimit* limit) {
  limit->Reserve(0);
  if (options.calibration_poses > 0) return {options.calibration_poses, true};
  const std::size_t wanted = WantedCalibrating(options);
  const auto within = static_cast<std::size_t>(
      std::clamp(limit->left() / (2 * kPoseKinds * kJudging * pose_seconds), 0.0, 1e9));
  if (within > 2 * wanted) return {wanted, true};
  const std::size_t poses = std::clamp(within, FewestCalibrating(options), wanted);
  if (poses < wanted)
    limit->LeaveOut(fmt::format("{} of {} poses of a kind to calibrate with", poses, wanted));
  limit->LeaveOut("no ranges beyond the trained ones");
  return {poses, false};
}

Result<FrameCost> CalibrateSubspace(const Calibrator& of, const CalibrationWork& work, const CueSet& cues,
                                    Subspace* subspace) {
  const Result<Carried> carried = TryCarried(of, work);
  if (!carried.ok()) return carried.status();
  subspace->carried = carried->rigid;
  subspace->space_scales = carried->scales;
  KPSA_RETURN_IF_ERROR(of.rig.set_clip(std::nullopt));

  GivePatches(of.patches, subspace);
  const std::size_t patches = subspace->patches.patches;  // that ranges speak of, whether they miss or not
  // Calibration poses of every kind; as many new ones say how to score them, and how far ranges reach. A picture
  // has few.
  const bool of_tiles = !of.options.without.trust;
  PoseJudge judge(of.rig, *subspace, of.layout, cues, of_tiles),
      score_judge(of.rig, *subspace, of.layout, cues, of_tiles);
  std::vector<RangeMargins> margins(1);
  JudgedSet outside;
  if (!of.rig.target.colors && of.size.margins) {
    KPSA_RETURN_IF_ERROR(SayStage(of.options, "margins", 0.9));
    Result<FoundMargins> found = FindMargins(of, work, cues, *subspace);
    if (!found.ok()) return found.status();
    margins = std::move(found->sets);
    outside = {std::move(found->outside), std::move(found->entries), {}};
  }
  JudgedSet calibrating, scoring;
  for (int k = 0; k < (of.rig.target.colors ? 1 : kPoseKinds); ++k) {
    if (k == kBeyond) continue;
    KPSA_RETURN_IF_ERROR(SayStage(of.options, "calibration", 0.9 + 0.025 * k));
    KPSA_RETURN_IF_ERROR(JudgePoses(of, work, k, kCalibrationSeed, {}, &judge, &calibrating));
    if (!of.rig.target.colors)
      KPSA_RETURN_IF_ERROR(JudgePoses(of, work, k, kScoreSeed, {}, &score_judge, &scoring));
  }
  KPSA_RETURN_IF_ERROR(SayStage(of.options, "calibration", 0.98));
  const std::vector<char> guarded = GuardedEntries(of.guards, *of.rig.graph, carried->rigid);
  const Result<std::vector<float>> rest = RestScalars(of, work);
  if (!rest.ok()) return rest.status();
  std::vector<Guarded> tried;  // by margins
  std::size_t taken = 0;
  double least = std::numeric_limits<double>::infinity();
  for (const RangeMargins& some : margins) {
    if (some.told_by_doubts && tried[taken].subspace.score.doubt == 0) continue;
    Result<Guarded> one = Guard(of, work, some, guarded, *rest, *subspace, &score_judge, scoring, outside);
    if (!one.ok()) return one.status();
    const double ns = one->chosen.cost.with_outside();
    tried.push_back(std::move(*one));
    if (tried.size() > 1 && ns > kAsGood * least) continue;
    taken = tried.size() - 1;
    least = std::min(least, ns);
  }
  std::vector<ExpectedOfMargins> expected;
  for (const Guarded& one : tried) {
    const double ns = one.chosen.cost.with_outside();
    expected.push_back({one.chosen.cost.misses, of.full_cost > 0 ? ns / of.full_cost : 0});
  }
  std::vector<Calibrated> calibrated(tried.size());
  const auto calibrate = [&](std::size_t i) -> Result<double> {
    JudgedSet own = calibrating;
    if (!of.rig.target.colors)
      KPSA_RETURN_IF_ERROR(JudgePoses(of, work, kBeyond, kCalibrationSeed + (taken - i),
                                      margins[i].of_controls, &judge, &own));
    if (i == taken) {
      work.record->held_out_rms = judge.rms();
      work.record->held_out_max = judge.max();
    }
    calibrated[i] = CalibrateWith(of, tried[i], guarded, patches, std::move(own));
    return calibrated[i].missed;
  };
  const Result<std::size_t> narrowed = NarrowByCalibration(taken, expected, calibrate);
  if (!narrowed.ok()) return narrowed.status();
  const std::size_t of_best = *narrowed;
  Calibrated& best = calibrated[of_best];
  std::vector<TrainingRecord::Rule>& rules = work.record->rules;
  rules.clear();
  for (const bool as_taken : {false, true}) {
    for (std::size_t i = 0; i < tried.size(); ++i) {
      if ((i == of_best) != as_taken) continue;
      const auto told = TriedRules(tried[i].chosen, margins[i], of.full_cost, as_taken);
      rules.insert(rules.end(), told.begin(), told.end());
    }
  }
  *subspace = std::move(best.subspace);
  if (!of.rig.target.colors)
    KPSA_RETURN_IF_ERROR(
        LimitActivity(of, work, guarded, best.calibration.threshold, best.judged, &judge, subspace));
  work.record->calibration_poses = best.judged.poses.size();
  work.record->separation = best.separation;
  FrameCost cost = tried[of_best].chosen.cost;
  if (scoring.judges.empty())
    cost = ExpectedCost(*subspace, best.judged.judges, 0, of.full_cost, kCautious * of.options.tolerance,
                        kCalibrationConfidence);
  cost.lost_of_clips = best.lost_of_clips;
  const Calibration& calibration = best.calibration;
  work.record->worst = {};  // an earlier calibration's
  if (calibration.worst != Calibration::kNoPose)
    RecordWorst(of, best.judged.poses[calibration.worst], calibration.worst_error, work.record);
  return cost;
}

std::vector<char> GuardedEntries(std::span<const Signal> guards, const Graph& graph,
                                 const std::vector<std::string>& carried) {
  std::vector<char> guarded;
  for (const Signal& signal : guards) {
    const bool free =
        signal.matrix && std::ranges::find(carried, graph.name(signal.plug.node)) != carried.end();
    guarded.insert(guarded.end(), signal.entries(), !free);
  }
  return guarded;
}

Status SayStage(const TrainOptions& options, const char* what, double share) {
  if (options.progress && !options.progress(what, share))
    return Status::Make(ErrorKind::kInterrupted, "interrupted");
  return Status();
}

}  // namespace kpsa::engine
