// What bench_ablation compares cues by: poses of a rig to learn from, frames of its test clip, and their
// modes.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "graph/evaluator.h"
#include "host/rig_training.h"
#include "kpsa/training/cue_selection.h"
#include "kpsa/training/pca.h"
#include "kpsa/training/pose_recorder.h"

namespace kpsa::engine::ablation {

struct AblationPoses {
  AblationPoses() = default;
  AblationPoses(const AblationPoses&) = delete;  // parts refer to each other
  AblationPoses& operator=(const AblationPoses&) = delete;

  // The rig's first accelerate entry: every third frame of its training clips, sweeps of all controls, and
  // samples; all frames of its first test clip, which plays from then on. samples 0: as many as the rig says.
  Status Load(const std::string& path, std::size_t samples);

  // Scalars of the layout, by what they are.
  enum class Sort : std::uint8_t { kLocal, kProduct, kMatrix };  // kMatrix: entries of world matrices
  Sort SortOf(Index scalar) const;
  // The plan that computes these cues and nothing else; null where there is none.
  std::shared_ptr<const Plan> PlanOf(const std::vector<CueRef>& cues);
  double PointsComputed(const std::vector<CueRef>& cues);
  // Of a frame, the median over the test clip.
  double Microseconds(const std::vector<CueRef>& cues);

  // Inputs (local scalars, then entries of world matrices) and output points of both, less their mean in
  // training, as arrays for bench/baselines.py.
  Status Dump(const std::string& path) const;

  NodeRegistry registry;
  Rig rig;
  AccelerateEntry entry;
  std::unique_ptr<PoseMatrix> training, test;  // centred
  Pca pca;
  std::vector<Double3> positions;  // mean, of outputs and stage points
  CueNoise noise{0};
  std::string stage;                    // the one before the last, whose points may be measured
  double diagonal = 0, motion_rms = 0;  // scene units; the motion of the test clip

 private:
  Status Record(const std::vector<TrainingClip>& clips, const TrainingClip& test_clip, std::size_t samples);
  Status MakeRecorder(const std::vector<TrainingClip>& clips);
  void AddProducts();
  Status FindModes();

  TrainingRig training_rig_;
  Compiler compiler_;
  std::unique_ptr<PoseRecorder> recorder_;
  std::vector<double> test_times_;
  std::vector<Index> totals_;  // points of each mesh
};

}  // namespace kpsa::engine::ablation
