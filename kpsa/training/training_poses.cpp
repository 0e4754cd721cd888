#include "kpsa/training/training_poses.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "kpsa/training/calibrate_subspace.h"
#include "kpsa/training/cue_products.h"
#include "kpsa/training/miss_samples.h"
#include "kpsa/training/signal_noise.h"
#include "kpsa/training/trained_ranges.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kBetween = 400;  // poses between the frames of all clips, at most
constexpr double kToSample =
    0.25;  // of the time that is left, where there is a limit: samples take no more of it,
constexpr std::size_t kLeastSampled = 250;  // but these are drawn in any case

// How many there is time for, where one takes so long.
std::size_t SamplesWithin(const TimeLimit& limit, double pose_seconds) {
  if (!std::isfinite(limit.left())) return std::numeric_limits<std::size_t>::max();
  const double within = kToSample * limit.left() / std::max(pose_seconds, 1e-9);
  return static_cast<std::size_t>(std::clamp(within, 0.0, 1e9));
}

}  // namespace

std::size_t TrainingPoses::SampledWithin(const TimeLimit& limit, std::size_t samples) const {
  return std::min(samples, SamplesWithin(limit, pose_seconds));
}

Status RecordPoses(TrainingSetup* setup, TrainingPoses* to, TrainingRecord* record) {
  const double before = setup->limit.elapsed();
  std::size_t frames = 0;
  for (const TrainingClip& clip : setup->trained_clips) frames += clip.times.size();
  const double between =
      setup->of_light() ? 0 : std::min(1.0, static_cast<double>(kBetween) / static_cast<double>(frames + 1));
  for (std::size_t c = 0; c < setup->trained_clips.size(); ++c) {
    KPSA_RETURN_IF_ERROR(
        setup->Say("poses", 0.2 * static_cast<double>(c) / static_cast<double>(setup->trained_clips.size())));
    KPSA_RETURN_IF_ERROR(
        setup->recorder->AddClip(WithTimesBetween(setup->trained_clips[c], between), &to->poses));
  }
  record->clip_poses = to->poses.poses();
  KPSA_RETURN_IF_ERROR(setup->Say("poses", 0.2));
  const Result<std::vector<SampledPose>> learnt =
      SamplesOf(setup->options.learnt_poses, setup->rig, setup->clips);
  if (!learnt.ok()) return learnt.status();
  if (setup->options.by_tile_as_before) {
    for (std::size_t c = setup->trained_clips.size(); c < setup->clips.size(); ++c) {
      to->learnt.emplace_back(setup->layout);
      KPSA_RETURN_IF_ERROR(
          setup->recorder->AddClip(WithTimesBetween(setup->clips[c], 1), &to->learnt.back()));
    }
    to->learnt.emplace_back(setup->layout);
    KPSA_RETURN_IF_ERROR(setup->recorder->AddSamples(*learnt, setup->clips, &to->learnt.back()));
  } else {
    KPSA_RETURN_IF_ERROR(setup->recorder->AddSamples(*learnt, setup->clips, &to->poses));
  }
  KPSA_RETURN_IF_ERROR(setup->sampler->LearnHowControlsMove());
  if (setup->options.by_tile_as_before) KPSA_RETURN_IF_ERROR(setup->trained_sampler->LearnHowControlsMove());
  const double of_clips = setup->limit.elapsed() - before;
  const std::size_t recorded = to->poses.poses(), wanted = setup->options.samples;
  const double of_one = recorded == 0 ? 0 : of_clips / static_cast<double>(recorded);
  setup->limit.Reserve(LeastCalibrationSeconds(of_one, setup->options));
  const std::size_t most = std::max(kLeastSampled, SamplesWithin(setup->limit, of_one));
  const Result<std::size_t> sampled = setup->trained_sampler->AddTraining(most, &to->poses);
  if (!sampled.ok()) return sampled.status();
  to->not_sampled = wanted - std::min(wanted, most);
  if (*sampled < std::min(wanted, most))
    setup->limit.LeaveOut(fmt::format("{} of {} samples, as more would take too much memory", *sampled,
                                      setup->options.samples));
  record->sampled_poses = to->poses.poses() - record->clip_poses;
  if (to->poses.poses() < 3)
    return Status::Invalid("{} training poses are too few: name clips or samples to train on",
                           to->poses.poses());
  KPSA_RETURN_IF_ERROR(setup->Say("poses", 0.4));
  const std::size_t sweeps = setup->rig.controls.empty() ? 0 : setup->sampler->SweepsWithTilts().size();
  to->pose_seconds = (setup->limit.elapsed() - before) / static_cast<double>(to->poses.poses() + sweeps);
  // Light takes some of these away
  const bool compares =
      !setup->of_light() &&
      (setup->places.size() > 1 || (setup->options.may_have_cues_by_tile && !setup->places.empty()));
  return compares ? setup->trained_sampler->AddJudges(&to->judges, &to->judge_kinds) : Status();
}

void FitPoses(TrainingSetup* setup, TrainingPoses* to, TrainingRecord* record) {
  if (!setup->of_light() && FitIntoTime(&to->poses, &record->clip_poses, to->not_sampled, &setup->limit))
    record->sampled_poses = to->poses.poses() - record->clip_poses;
}

void ChooseProducts(TrainingSetup* setup, TrainingPoses* poses) {
  CueProductOptions options =
      ProductOptionsOf(setup->recorder->signals(), setup->layout, setup->options.tolerance);
  options.hinges = !setup->options.without.hinges;
  setup->recorder->SetProducts(ChooseCueProducts(poses->poses, options));
  for (PoseMatrix* matrix : {&poses->poses, &poses->judges}) {
    for (std::size_t t = 0; t < matrix->poses(); ++t)
      StoreProducts(setup->recorder->products(), setup->layout, matrix->row(t));
  }
}

}  // namespace kpsa::engine
