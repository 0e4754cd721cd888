#include "kpsa/training/trainer.h"

#include <utility>

#include "kpsa/training/finer_subspaces.h"
#include "kpsa/training/training_cancel.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kJudgeOfLight = 5;  // of so many poses, one

// What was asked for.
TrainingRecord RecordOf(const std::vector<TrainingClip>& clips, const TrainOptions& options) {
  TrainingRecord record;
  record.seed = options.seed;
  record.mode = options.mode == EstimatorMode::kMap ? "map" : "paper";
  record.asked = {options.samples,
                  options.calibration_poses,
                  options.rows,
                  static_cast<std::size_t>(options.max_modes),
                  options.mode == EstimatorMode::kPaper ? options.key_points : options.min_points,
                  options.may_have_cues_by_tile};
  for (const TrainingClip& clip : clips) {
    if (clip.learnt) record.learnt.emplace_back(clip.name, clip.times);
    if (!clip.learnt) record.clips.push_back(clip.name);
  }
  record.learnt_poses = options.learnt_poses;
  return record;
}

// Of all poses as they were recorded.
Status FindRanges(TrainingSetup* setup, const TrainingPoses& poses, RangeFinder* ranges) {
  *ranges = RangeFinder(setup->layout);
  ranges->Widen(poses.poses);
  if (poses.spare) ranges->Widen(*poses.spare);
  for (const PoseMatrix& learnt : poses.learnt) ranges->Widen(learnt);
  return setup->of_light() ? Status() : ranges->Widen(setup->clips, setup->recorder.get());
}

// Which rig it was trained on.
void Sign(const TrainingSetup& setup, Subspace* subspace) {
  const TrainingRig& rig = setup.rig;
  subspace->rig.signature =
      RigSignature(*rig.graph, rig.target.outputs(), rig.target.space, rig.target.controls);
  subspace->rig_hash = SignatureDigest(subspace->rig.signature);
  std::vector<std::string>& controls = subspace->rig.controls;
  for (const PlugRef& control : rig.target.controls) controls.push_back(rig.graph->PlugName(control));
  for (std::size_t c = setup.drawn.size(); c < rig.controls.size(); ++c)
    controls.push_back(rig.graph->PlugName(rig.controls[c].plug));
}

Result<Subspace> TrainOnce(const TrainingRig& rig, const std::vector<TrainingClip>& clips,
                           const TrainOptions& options) {
  TrainingSetup setup(rig, clips, options);
  TrainingRecord record = RecordOf(clips, options);
  KPSA_RETURN_IF_ERROR(setup.Prepare());

  // Poses
  TrainingPoses poses(setup.layout);
  KPSA_RETURN_IF_ERROR(RecordPoses(&setup, &poses, &record));
  FitPoses(&setup, &poses, &record);
  KPSA_RETURN_IF_ERROR(setup.Say("modes", 0.45));
  poses.clip_poses = record.clip_poses;
  if (!setup.of_light()) poses.spare = SpareForModes(&poses.poses, &poses.clip_poses);
  const double before_modes = setup.limit.elapsed();
  if (setup.layout.products > 0) ChooseProducts(&setup, &poses);
  RangeFinder ranges(setup.layout);
  KPSA_RETURN_IF_ERROR(FindRanges(&setup, poses, &ranges));
  if (setup.of_light() && setup.of_map()) poses.judges = poses.poses.TakeEvery(kJudgeOfLight);

  // Modes and cues
  TrainingModes modes;
  KPSA_RETURN_IF_ERROR(FindModes(setup, &poses, &modes, &record));
  SubspaceCandidates candidates{&setup, &poses, &modes, &record, setup.limit.elapsed() - before_modes};
  KPSA_RETURN_IF_ERROR(ChooseTrainingCues(options.tolerance, poses, &setup, &modes, &candidates.cues));

  // Subspaces
  KPSA_RETURN_IF_ERROR(setup.Say("subspace", 0.85));
  const bool of_points = !setup.of_light() && setup.of_map();
  if (of_points && !options.without.patches) {
    KPSA_RETURN_IF_ERROR(setup.rig.set_clip(std::nullopt));
    Result<PatchLayout> patches = PricePatches(setup.rig, &setup.compiler, setup.totals, modes.positions);
    if (!patches.ok()) return patches.status();
    candidates.patches = std::move(*patches);
  }
  Result<Subspace> subspace = candidates.Best();
  if (!subspace.ok()) return subspace;
  KPSA_RETURN_IF_ERROR(setup.Say("calibration", 0.95));
  const CandidateCalibrator calibrator{&candidates, ranges,
                                       CalibrationWithin(poses.pose_seconds, options, &setup.limit)};
  KPSA_RETURN_IF_ERROR(calibrator.Calibrate(&*subspace));
  const FrameCost& cost = candidates.cost;
  if (of_points && !options.without.miss_costs && calibrator.size.margins && candidates.IsWorthTrying(cost) &&
      (!candidates.fine || cost.lost() > kTooManyMisses) && setup.limit.left() > candidates.modes_seconds)
    KPSA_RETURN_IF_ERROR(calibrator.TryFiner(&*subspace));

  KPSA_RETURN_IF_ERROR(setup.rig.set_clip(std::nullopt));
  Sign(setup, &*subspace);
  record.limited = setup.limit.left_out();
  subspace->training = TrainingJson(record);
  KPSA_RETURN_IF_ERROR(ValidateSubspace(*subspace));
  return subspace;
}

}  // namespace

Result<Subspace> Train(const TrainingRig& rig, const std::vector<TrainingClip>& clips,
                       const TrainOptions& options) {
  TrainingCancel cancel(options.progress);
  const CancelScope scope(&cancel);
  TrainOptions watched = options;
  if (options.progress)
    watched.progress = [&](const char* what, double share) { return cancel.Say(what, share); };
  try {
    Result<Subspace> trained = TrainOnce(rig, clips, watched);
    if (!trained.ok() && cancel.asked()) throw Cancelled();  // an evaluation that was ended, say
    if (!trained.ok() || !watched.by_tile_as_before || trained->by_tile()) return trained;
    watched.by_tile_as_before = false;  // with cues for all points, what is learnt changes all of them
    return TrainOnce(rig, clips, watched);
  } catch (const Cancelled&) {
    KPSA_RETURN_IF_ERROR(rig.set_clip(std::nullopt));
    return Status::Make(ErrorKind::kInterrupted, "interrupted");
  }
}

}  // namespace kpsa::engine
