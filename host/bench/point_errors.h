// How far one evaluation's points are from another's, over many frames.
#pragma once

#include <cstdint>
#include <vector>

#include "base/types.h"
#include "graph/evaluator.h"

namespace kpsa::engine {

class PointErrors {
 public:
  PointErrors() = default;
  // The first `outputs` outputs of both evaluators are points, as many on both sides.
  explicit PointErrors(std::size_t outputs) : outputs_(outputs) {}

  // The largest distance of this frame, metres; infinity where something is not finite.
  double AddFrame(const Evaluator& exact, const Evaluator& other);
  double frame_rms() const { return frame_rms_; }  // of the last frame: the largest of an output's RMS
  void Merge(const PointErrors& later);

  double rms() const;
  // The distance that a share of all points of all frames does not exceed, to within 2 % (counted in bins).
  double Percentile(double share) const;
  // RMS distance of the exact points from their mean over the frames of their PointErrors.
  double motion_rms() const;
  double diagonal() const;  // of the box around all exact points

 private:
  std::size_t outputs_ = 0;
  double squares_ = 0, frame_rms_ = 0;
  std::uint64_t count_ = 0;
  std::vector<std::uint64_t> bins_;  // of distances, by their logarithm
  double low_[3] = {1e300, 1e300, 1e300}, high_[3] = {-1e300, -1e300, -1e300};
  // Moments of the exact points about the first frame
  std::vector<double> first_, sum_, square_sum_;
  std::size_t frames_ = 0;
  double merged_motion_ = 0;  // sum of squared distances from the mean of what was merged
  double Motion() const;
};

}  // namespace kpsa::engine
