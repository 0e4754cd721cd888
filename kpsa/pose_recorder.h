// Evaluates poses of a rig into rows of a pose matrix: output points, candidate points of earlier stages,
// and entries of signals, all in the space of the target. A pose with a value that is not finite is an error
// that names it. Internal to training.
#pragma once

#include "graph/evaluator.h"
#include "kpsa/pose_matrix.h"
#include "kpsa/trainer.h"

namespace kpsa {

// Points of an earlier stage of a mesh that may become cues.
struct CandidateStage {
  std::size_t mesh = 0, stage = 0;  // in AccelerationTarget::meshes, in its stages
  std::vector<Index> points;        // of the mesh
};

class PoseRecorder {
 public:
  PoseRecorder(const TrainingRig& rig, Compiler* compiler, std::vector<CandidateStage> candidates,
               std::vector<Signal> signals, const Matrix4& inverse_rest_stretch = Matrix4())
      : rig_(rig),
        compiler_(compiler),
        candidates_(std::move(candidates)),
        signals_(std::move(signals)),
        inverse_rest_stretch_(inverse_rest_stretch) {}
  Result<PoseLayout> Layout();
  // Appends a row for each time of a clip.
  Status AddClip(const TrainingClip& clip, PoseMatrix* poses);
  // Appends a row for each sampled pose.
  Status AddSamples(const std::vector<SampledPose>& samples, const std::vector<TrainingClip>& clips,
                    PoseMatrix* poses);
  // Widens the ranges [lo, hi] of all entries of the signals, in their order, by what they are at times of a
  // clip; no points are evaluated.
  Status WidenRanges(const TrainingClip& clip, std::vector<double>* lo, std::vector<double>* hi);
  // The controls that would give the poses of the clips (ControlRange::shown), at rest where nothing shows
  // them.
  Result<ClipPoses> ControlsOfClips(const std::vector<TrainingClip>& clips);
  const std::vector<Signal>& signals() const { return signals_; }
  const std::vector<CandidateStage>& candidates() const { return candidates_; }

 private:
  Result<std::shared_ptr<const Plan>> CompileFor(const std::vector<PlugRef>& varying);
  std::string NameOf(const SampledPose& pose, const std::vector<TrainingClip>& clips) const;
  // Of the space, which is the last output of the plan.
  Matrix4 SpaceFromWorld(const Evaluator& evaluator) const;
  void StoreSignals(const Evaluator& evaluator, const Matrix4& space_from_world, Index first_output,
                    std::span<float> entries) const;
  Status CheckFinite(std::span<const float> row) const;
  Status Record(const std::shared_ptr<const Plan>& plan, std::size_t count, PoseMatrix* poses,
                const std::function<void(std::size_t, Evaluator&)>& set,
                const std::function<std::string(std::size_t)>& name);
  void Store(const Evaluator& evaluator, std::span<float> row) const;

  const TrainingRig& rig_;
  Compiler* compiler_;
  std::vector<CandidateStage> candidates_;
  std::vector<Signal> signals_;
  Matrix4 inverse_rest_stretch_;
  PoseLayout layout_;
};

}  // namespace kpsa
