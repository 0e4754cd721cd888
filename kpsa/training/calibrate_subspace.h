// What a finished subspace misses and promises: evaluates new poses of every kind, finds the ranges that
// guards keep, and pairs scores with errors. Internal to training.
#pragma once

#include "kpsa/training/frame_cost.h"
#include "kpsa/training/time_limit.h"
#include "kpsa/training/trained_ranges.h"
#include "kpsa/training/training_sampler.h"

namespace kpsa::engine {

struct CalibrationSize {
  std::size_t poses = 0;  // of a kind, to calibrate with; as many others to choose by
  bool margins = true;    // ranges may reach beyond what was trained
};
// As many poses as the options ask for, or as their rate needs (8 / violation_rate, 400 to 1,000). Where
// there is no time for these, and nobody asks for a number: no margins, and fewer poses, but more than the
// fewest that can promise this rate at all. pose_seconds: what a pose took to train on.
// What was set aside for it is free again.
CalibrationSize CalibrationWithin(double pose_seconds, const TrainOptions& options, TimeLimit* limit);
// How long the least of these takes, about, and trying what was made.
double LeastCalibrationSeconds(double pose_seconds, const TrainOptions& options);

// All references must outlive it.
struct Calibrator {
  const TrainingRig& rig;  // with tilts
  const std::vector<TrainingClip>& clips;
  const TrainOptions& options;
  const std::vector<Signal>& guards;  // the recorder's first signals
  const PoseLayout& layout;
  const PatchLayout& patches;  // that may miss by themselves
  double diagonal = 0, full_cost = 0;
  Matrix4 inverse_rest_stretch;
  CalibrationSize size;
};
// What it works with, and leaves behind: wider ranges, and the record of the calibration.
struct CalibrationWork {
  Compiler* compiler = nullptr;
  PoseRecorder* recorder = nullptr;
  const TrainingSampler* sampler = nullptr;
  RangeFinder* ranges = nullptr;
  TrainingRecord* record = nullptr;
};
// Gives the subspace its score, ranges and calibration; cues: its own. The expected cost of a frame comes
// without that of its points.
Result<FrameCost> CalibrateSubspace(const Calibrator& calibrator, const CalibrationWork& work,
                                    const CueSet& cues, Subspace* subspace);

// By entry of the guards: whether it has one where the space carries the points.
std::vector<char> GuardedEntries(std::span<const Signal> guards, const Graph& graph,
                                 const std::vector<std::string>& carried);

// A stage of training and how much of it is done; kInterrupted where nobody wants to go on.
Status SayStage(const TrainOptions& options, const char* what, double share);

}  // namespace kpsa::engine
