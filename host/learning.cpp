#include "host/learning.h"

#include <algorithm>
#include <cstdint>

#include "host/rig_frames.h"
#include "host/rig_training.h"
#include "host/verdicts.h"
#include "kpsa/training/tile_splice.h"
#include "kpsa/training_record.h"

namespace kpsa::engine {
namespace {

// The rig once more, for the learner alone.
Result<LearnerRig> OpenForLearner(const RigOpener& opener, const std::optional<std::string>& name) {
  Result<std::unique_ptr<OpenRig>> opened = opener.open({});
  if (!opened.ok()) return opened.status();
  const std::shared_ptr<OpenRig> open = std::move(*opened);
  const Result<AccelerateEntry> entry = ChooseEntry(open->rig, name);
  if (!entry.ok()) return entry.status();
  LearnerRig rig;
  rig.owner = open;
  rig.training = MakeTrainingRig(&open->rig, *entry);
  rig.frames = [open](const std::string& clip) -> Result<TrainingClip> {
    Result<std::vector<TrainingClip>> clips = ClipFrames(open->rig, {clip});
    if (!clips.ok()) return clips.status();
    return std::move(clips->front());
  };
  rig.samples = TrainOptionsOf(open->rig, *entry).samples;
  return rig;
}

TileCounts CountTiles(const Subspace& before, const Subspace& after) {
  TileCounts counts;
  if (!before.by_tile() || !after.by_tile()) return counts;
  for (std::size_t m = 0; m < std::min(before.tiles.size(), after.tiles.size()); ++m) {
    const std::vector<char> same = SameTiles(before.tiles[m], after.tiles[m]);
    counts.all += same.size();
    counts.kept += static_cast<std::size_t>(std::ranges::count(same, 1));
  }
  return counts;
}

std::size_t LearntFrames(const Subspace& subspace) {
  std::size_t frames = 0;
  for (const auto& [clip, times] : ParseTraining(subspace.training).learnt) frames += times.size();
  return frames;
}

}  // namespace

Result<ClipTrial> TryClip(const RigOpener& opener, const std::string& clip, const std::string& subspace,
                          const Watch& watch) {
  const Result<std::unique_ptr<OpenRig>> open = opener.open({.clip = clip});
  if (!open.ok()) return open.status();
  Rig& rig = (*open)->rig;
  const Result<std::vector<double>> times = opener.times(**open);
  if (!times.ok()) return times.status();
  Compiler compiler;
  AccelerationChoice choice;
  choice.subspace = subspace;
  const Result<std::vector<AppliedSubspace>> applied = ApplyAcceleration(&rig, &compiler, choice);
  if (!applied.ok()) return applied.status();
  Request request;
  request.varying = VaryingPlugs(rig);
  Verdicts verdicts(*applied);
  verdicts.Ask(rig, &request);
  const auto plan = CompileFor(rig, &compiler, request);
  if (!plan.ok()) return plan.status();
  ClipTrial trial;
  RigFrameOptions options;
  options.watch.cancel = watch.cancel;
  KPSA_RETURN_IF_ERROR(
      EvaluateTimes(rig, *plan, *times, options, [&](std::size_t frame, const Evaluator& evaluator) {
        verdicts.Add(FrameNumber((*times)[frame], rig.fps), evaluator);
        if (!verdicts.records().back().decision.hit()) trial.missed.push_back({clip, (*times)[frame]});
        return Status();
      }));
  trial.hits = verdicts.hits();
  trial.blends = verdicts.count(FrameVerdict::kBlend), trial.misses = verdicts.count(FrameVerdict::kMiss);
  trial.reason = verdicts.MostFrequentReason();
  return trial;
}

Result<LearnResult> LearnMisses(const RigOpener& opener, const std::shared_ptr<const Subspace>& old,
                                const LearnOptions& options) {
  LearnerOptions learner_options;
  learner_options.threads = 0;  // nothing else is done meanwhile
  learner_options.progress = options.progress;
  Learner learner(
      old, [&] { return OpenForLearner(opener, options.entry); }, std::move(learner_options));
  LearnResult result;
  for (const std::string& clip : options.clips) {
    Result<ClipTrial> trial = TryClip(opener, clip, options.subspace, options.watch);
    if (!trial.ok()) return trial.status();
    for (const Miss& miss : trial->missed) learner.Add(miss);
    result.clips.push_back({clip, std::move(*trial), {}});
  }
  if (!learner.Learn()) {
    for (LearnResult::Clip& clip : result.clips) clip.after = clip.before;
    return result;
  }
  KPSA_RETURN_IF_ERROR(learner.Wait().At({opener.path}));
  result.subspace = learner.TakeNewest();
  result.frames = LearntFrames(*result.subspace) - LearntFrames(*old);
  result.tiles = CountTiles(*old, *result.subspace);
  return result;
}

}  // namespace kpsa::engine
