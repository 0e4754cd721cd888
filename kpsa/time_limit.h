// How long training may take: what is left of it, and how many poses can be worked through in that.
// Internal to training.
#pragma once

#include <chrono>

#include "kpsa/pose_matrix.h"

namespace kpsa {

class TimeLimit {
 public:
  explicit TimeLimit(double seconds) : seconds_(seconds) {}  // infinity: none
  double elapsed() const;                                    // seconds since it was made
  double left() const { return seconds_ - elapsed(); }

 private:
  double seconds_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

// How many of the poses (not centred) can be trained on within so many seconds, by what products of some of
// them take here; at least 250.
std::size_t PosesWithin(double seconds, const PoseMatrix& poses);

}  // namespace kpsa
