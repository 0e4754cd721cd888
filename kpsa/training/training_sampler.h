// Draws the poses that are trained on, judged and calibrated with, of every kind (PoseKind), with tilts
// (kpsa/training/tilts.h), and records them. Internal to training.
#pragma once

#include <span>
#include <vector>

#include "kpsa/training/branches.h"
#include "kpsa/training/control_groups.h"
#include "kpsa/training/pose_recorder.h"

namespace kpsa::engine {

class TrainingSampler {
 public:
  // All must outlive it. rig: with tilts, of whose controls the first `drawn` are its own; layout: the
  // recorder's.
  TrainingSampler(const TrainingRig& rig, std::vector<ControlRange> drawn,
                  const std::vector<TrainingClip>& clips, const TrainOptions& options, PoseRecorder* recorder,
                  const PoseLayout& layout);

  // What the clips do with the controls, and which of these act together: first of all.
  Status LearnHowControlsMove();

  const std::vector<ControlRange>& drawn() const { return drawn_; }  // the rig's own controls
  std::vector<std::size_t> held() const { return HeldControls(drawn_, clip_poses_); }
  // Without recording them.
  // margins: by control (ControlRange), or none.
  std::vector<SampledPose> Of(PoseKind kind, std::size_t count, std::uint64_t seed,
                              std::span<const double> margins = {}) const;
  // `each` poses of each of some controls, which it holds far out over the clips (PosesAlone); control after
  // control.
  std::vector<SampledPose> Alone(std::span<const std::size_t> held, std::size_t each,
                                 std::uint64_t seed) const;
  std::vector<SampledPose> SweepsWithTilts() const;  // each control alone

  // Sweeps, and as many samples as the options want and memory holds: the sampler's kind, and some of the
  // others, but no more than `most`. Light: no others. How many samples were drawn.
  Result<std::size_t> AddTraining(std::size_t most, PoseMatrix* poses) const;
  // How many poses these two add, where there is room for all.
  std::size_t MoreForTiles() const;
  // More samples, of another seed, as far as there is room beside the poses; and PosesTogether, for tiles with
  // cues of their own. share: of all these.
  Status AddMore(const PoseMatrix& beside, double share, PoseMatrix* poses) const;
  // PosesFolded, as many as there is room for beside so many poses; likewise.
  Status AddFolded(std::size_t beside, double share, PoseMatrix* poses) const;
  // PosesFolded, not recorded.
  std::vector<SampledPose> Folded(std::size_t count, std::uint64_t seed) const;
  // New poses that judge; kinds: the PoseKind of each.
  Status AddJudges(PoseMatrix* judges, std::vector<int>* kinds) const;

 private:
  bool of_light() const { return rig_.target.colors; }
  std::size_t PoseBytes() const { return sizeof(float) * layout_.columns(); }
  std::size_t RoomBeside(std::size_t poses) const;
  std::size_t SamplesOf(double share) const;
  Status AddSampled(std::size_t count, std::uint64_t seed, PoseMatrix* poses) const;

  const TrainingRig& rig_;
  const std::vector<ControlRange> drawn_;
  const std::vector<Branch> branches_;
  const std::vector<TrainingClip>& clips_;
  const TrainOptions& options_;
  PoseRecorder* recorder_;
  const PoseLayout& layout_;
  ClipPoses clip_poses_;
  ControlGroups groups_;
};

}  // namespace kpsa::engine
