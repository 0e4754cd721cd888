// How long training takes: what is left of the time it is given, and with how many poses. Internal to
// training.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "kpsa/training/pose_matrix.h"

namespace kpsa::engine {

class TimeLimit {
 public:
  explicit TimeLimit(double seconds) : seconds_(seconds) {}  // infinity: none
  double elapsed() const;                                    // seconds since it was made
  double left() const { return seconds_ - reserved_ - elapsed(); }
  // Sets so many seconds of it aside, in the place of those before: what has to come at the end.
  void Reserve(double seconds) { reserved_ = seconds; }
  // What is left out for want of time, once each: told at the end.
  void LeaveOut(const std::string& what);
  std::string left_out() const;

 private:
  double seconds_, reserved_ = 0;
  std::vector<std::string> left_out_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

// How many of the poses (not centred) can be trained on within so many seconds, by what products of some of
// them take here; at least 250.
std::size_t PosesWithin(double seconds, const PoseMatrix& poses);

// Leaves `count` of the poses, spread evenly; of_clips: how many of them, first, are of clips.
void KeepSpread(std::size_t count, PoseMatrix* poses, std::size_t* of_clips);

// Leaves as many of the poses as there is time for, as these two say, and tells so, of these and of others that were not
// even recorded; false where all fit.
bool FitIntoTime(PoseMatrix* poses, std::size_t* of_clips, std::size_t not_recorded, TimeLimit* limit);

// Modes take the square of the poses, times their columns. Where that would be most of the time of a
// training, every fourth pose is taken out, for what grows with their number alone; of_clips as above.
inline constexpr double kMostModeWork = 8.5e11;  // ten to fifteen seconds
std::optional<PoseMatrix> SpareForModes(PoseMatrix* poses, std::size_t* of_clips,
                                        double most_work = kMostModeWork);

}  // namespace kpsa::engine
