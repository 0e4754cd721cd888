// The ranges that guards keep: what training and calibration saw of every entry of a signal, and how fast a
// guard comes in beyond. Internal to training.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "kpsa/training/pose_recorder.h"

namespace kpsa::engine {

class RangeFinder {
 public:
  RangeFinder() = default;
  explicit RangeFinder(const PoseLayout& layout) : layout_(layout) {}

  void Widen(const PoseMatrix& poses);         // not centred
  void Widen(std::span<const float> scalars);  // of one pose, all of them
  void Widen(const RangeFinder& others);
  void Widen(Index first, std::span<const float> scalars);  // some of them, which have ranges
  void Plays(const PoseMatrix& poses);                      // they are posed as such: played() has them
  // By the clips between their times: quaternion keys turn joints about axes there that no frame has.
  Status Widen(const std::vector<TrainingClip>& clips, PoseRecorder* recorder);
  bool Moves(Index first, std::size_t count) const;  // one of these scalars, by more than float noise
  // Of frames of the clips (of very many, some), and of what Plays was given: all scalars of each.
  const std::vector<std::vector<float>>& played() const { return *played_; }

  struct Options {
    double tolerance = 0, range_ramp = 0;  // as TrainOptions
    double diagonal = 0;                   // of the model
    Matrix4 inverse_rest_stretch;
    std::span<const float> rest = {};  // [scalars] at rest; empty: ranges have no reach
  };
  // Of the first signals of the layout, which have guards.
  Result<std::vector<TrainedRange>> Make(const TrainingRig& rig, Compiler* compiler,
                                         const std::vector<Signal>& guards, const Options& options) const;

 private:
  PoseLayout layout_;
  std::vector<double> lo_, hi_;  // [scalars]; empty before the first pose
  // Copies, which are made to be wider, have the same
  std::shared_ptr<std::vector<std::vector<float>>> played_ =
      std::make_shared<std::vector<std::vector<float>>>();
};

// Poses beyond the ranges of their controls, half as far beyond: training ends there, and on the other half
// guards come in, and calibration looks.
void HalfAsFarBeyond(const std::vector<ControlRange>& controls, std::vector<SampledPose>* poses);

// A share of the spans between two times gets one more, at all places in between.
TrainingClip WithTimesBetween(const TrainingClip& clip, double share);

}  // namespace kpsa::engine
