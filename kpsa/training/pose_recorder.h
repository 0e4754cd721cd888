// Evaluates poses of a rig into rows of a pose matrix: output points, candidate points of earlier stages,
// and entries of signals, all in the space of the target. A pose with a value that is not finite is an error
// that names it; so is one in which a last step, run by itself, does not give what comes out. Internal to training.
#pragma once

#include <map>
#include <optional>

#include "graph/evaluator.h"
#include "kpsa/training/cue_products.h"
#include "kpsa/training/pose_matrix.h"
#include "kpsa/training/trainer.h"

namespace kpsa::engine {

// Points of an earlier stage of a mesh that may become cues.
struct CandidateStage {
  std::size_t mesh = 0, stage = 0;  // in AccelerationTarget::meshes, in its stages
  std::vector<Index> points;        // of the mesh
};

// A pose as it was recorded, for another recorder of the same rig. Empty values: the clip plays, no control is sampled.
struct RecordedPose {
  std::optional<std::string> clip;
  double time = 0;
  std::vector<double> values;  // by control
};

RecordedPose RecordedOf(const SampledPose& pose, const std::vector<TrainingClip>& clips);

// The scalar of each signal's first entry.
std::vector<Index> FirstScalars(std::span<const Signal> signals, const PoseLayout& layout);

class PoseRecorder {
 public:
  // tolerance: a share of it is what a last step, run by itself, may be off by; metres.
  PoseRecorder(const TrainingRig& rig, Compiler* compiler, std::vector<CandidateStage> candidates,
               std::vector<Signal> signals, const Matrix4& inverse_rest_stretch = Matrix4(),
               double tolerance = 0)
      : rig_(rig),
        compiler_(compiler),
        candidates_(std::move(candidates)),
        signals_(std::move(signals)),
        inverse_rest_stretch_(inverse_rest_stretch),
        tolerance_(tolerance) {
    for (std::size_t m = 0; m < rig.split.size(); ++m) {
      const LastStep* step = rig.step(m);
      steps_.push_back(step == nullptr ? nullptr
                                       : step->Bind(PointSet::All(static_cast<Index>(step->points()))));
    }
  }
  // Records some points of each mesh instead of all. Before anything else, and not of meshes with last steps.
  void Only(std::vector<PointSet> points) { only_ = std::move(points); }
  // Rows know from now on which poses they are (PoseMatrix::origin).
  void KeepOrigins() { keeps_origins_ = true; }
  const RecordedPose& recorded(std::uint32_t origin) const { return recorded_[origin]; }
  // Scalars of the layout: signals that are not relative, `products` of them, relative matrices.
  Result<PoseLayout> Layout(std::size_t products = 0);
  // What is recorded from now on has them.
  void SetProducts(std::vector<CueProduct> products) { products_ = std::move(products); }
  const std::vector<CueProduct>& products() const { return products_; }
  // Appends a row for each time of a clip.
  Status AddClip(const TrainingClip& clip, PoseMatrix* poses);
  // Appends a row for each sampled pose.
  Status AddSamples(const std::vector<SampledPose>& samples, const std::vector<TrainingClip>& clips,
                    PoseMatrix* poses);
  // Poses that another one recorded, each into the row that is given for it.
  Status Replay(std::span<const RecordedPose* const> poses,
                const std::function<std::span<float>(std::size_t)>& row);
  // All entries of the signals, in their order, at each time of a clip; no points are evaluated.
  Status VisitSignals(const TrainingClip& clip, const std::function<void(std::span<const float>)>& visit);
  // Likewise, in each of these poses, which play no clip.
  Status VisitSignals(const std::vector<SampledPose>& poses,
                      const std::function<void(std::span<const float>)>& visit);
  // The controls that would give the poses of the clips (ControlRange::shown), at rest where nothing shows
  // them.
  Result<ClipPoses> ControlsOfClips(const std::vector<TrainingClip>& clips);
  const std::vector<Signal>& signals() const { return signals_; }
  const std::vector<CandidateStage>& candidates() const { return candidates_; }
  const PoseLayout& layout() const { return layout_; }

 private:
  using PlanResult = Result<std::shared_ptr<const Plan>>;
  PlanResult CompileFor(const std::vector<PlugRef>& varying);
  // The plan of a clip, or with none: sampled, with the controls that the clip leaves free, else with time.
  PlanResult PlanOf(const std::string* clip, bool sampled);
  Result<std::shared_ptr<const Plan>> PlanOfSignals(std::vector<PlugRef> varying);
  std::string NameOf(const SampledPose& pose, const std::vector<TrainingClip>& clips) const;
  // Of the space, which is the last output of the plan.
  Matrix4 SpaceFromWorld(const Evaluator& evaluator) const;
  void StoreSignals(const Evaluator& evaluator, const Matrix4& space_from_world, Index first_output,
                    std::span<float> entries) const;
  Status CheckFinite(std::span<const float> row) const;
  // All of one clip (or without one), and all sampled or none.
  Status Record(std::span<const RecordedPose* const> poses,
                const std::function<std::span<float>(std::size_t)>& row,
                const std::function<std::string(std::size_t)>& name);
  // The same, appended.
  Status Add(std::span<const RecordedPose* const> poses, PoseMatrix* to,
             const std::function<std::string(std::size_t)>& name);
  // How far what comes out of last steps is from what these give, run by themselves (metres).
  double Store(const Evaluator& evaluator, std::span<float> row) const;

  const TrainingRig& rig_;
  Compiler* compiler_;
  std::vector<CandidateStage> candidates_;
  std::vector<Signal> signals_;
  std::vector<CueProduct> products_;
  std::vector<PointSet> only_;  // by mesh; empty: all points
  bool keeps_origins_ = false;
  std::vector<RecordedPose> recorded_;  // by origin
  // By clip (none: the rest pose), and whether controls are sampled; binding wraps takes long
  std::map<std::pair<std::optional<std::string>, bool>, std::shared_ptr<const Plan>> plans_;
  Matrix4 inverse_rest_stretch_;
  double tolerance_ = 0;
  std::vector<std::shared_ptr<const LastStep::Bound>> steps_;  // by mesh, as rig.split
  PoseLayout layout_;
};

}  // namespace kpsa::engine
