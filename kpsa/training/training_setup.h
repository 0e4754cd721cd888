// What training knows before it evaluates a pose: the rig, what can be measured of it and at which cost. Internal to
// training.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "graph/compiler.h"
#include "kpsa/training/cue_places.h"
#include "kpsa/training/time_limit.h"
#include "kpsa/training/training_sampler.h"

namespace kpsa::engine {

// Stays where it is: its parts refer to each other. rig, clips and options must outlive it.
struct TrainingSetup {
  TrainingSetup(const TrainingRig& rig, const std::vector<TrainingClip>& clips, const TrainOptions& options);
  TrainingSetup(const TrainingSetup&) = delete;
  TrainingSetup& operator=(const TrainingSetup&) = delete;

  // Finds stages, signals and guards, and makes recorder and samplers. Before anything else.
  Status Prepare();

  bool of_light() const { return rig.target.colors; }
  bool of_map() const { return options.mode == EstimatorMode::kMap; }
  // To TrainOptions::progress; an error where that cancels.
  Status Say(const char* what, double share) const;
  std::vector<SubspaceOutput> Outputs() const;
  // What the graph spends until the points among the cues are there (ns, on the scale of the nodes' costs).
  Result<double> CostOfPoints(std::span<const CueRef> cues);
  double CostOfSteps() const;  // likewise, of the last steps after inner points
  // The mesh and the point that a row of the tiles of all meshes (row k of tile t is kTilePoints t + k) is, where only some
  // points go through a last step, or none does; nothing where it is one of these, or what the step reads besides.
  std::optional<std::pair<std::size_t, Index>> PointThatComesOut(std::size_t row) const;

  const TrainingRig rig;                  // its controls are the rig's, then tilts
  const std::vector<ControlRange> drawn;  // the rig's
  const std::vector<TrainingClip>& clips;
  // Of these, what modes and tiles are made of: all, or those before the learnt ones
  const std::vector<TrainingClip> trained_clips;
  const TrainOptions& options;
  TimeLimit limit;
  Compiler compiler;
  std::unique_ptr<PoseRecorder> recorder;
  std::shared_ptr<TrainingSampler> sampler, trained_sampler;  // the latter without what was learnt
  PoseLayout layout;
  std::vector<Index> totals;  // points of each output's mesh
  std::vector<CuePlace> places;
  CuePlace of_tiles;
  double full_cost = 0;        // of the whole evaluation, likewise
  std::vector<Signal> guards;  // the recorder's first signals: relative matrices follow, which only measure
  Matrix4 inverse_rest_stretch;
};

}  // namespace kpsa::engine
