// Radial basis functions over rotations: how near a rotation is to each of a few named poses (Maya's
// poseInterpolator).
//
// A rotation is taken as a point in space whose distances are chords, 2 sin(angle / 2): for the whole
// rotation its matrix, for its swing where the twist axis points, for its twist the angle about the axis. The
// weights are w(x) = sum_i W_i phi(|x - x_i|), with (Phi + regularization I) W = I solved at bind: without
// regularization a pose has weight 1 at itself and 0 at the others. Gaussian and linear functions over
// different poses always give a regular matrix (Micchelli, Interpolation of scattered data, 1986). Double,
// pure, any thread.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "base/status.h"
#include "base/types.h"

namespace kpsa::engine {

struct PoseSpace {
  enum class Part : std::uint8_t { kSwingAndTwist, kSwing, kTwist };
  Part part = Part::kSwingAndTwist;
  Double3 twist_axis{1, 0, 0};  // unit length
  static constexpr std::size_t kMost = 9;
  std::size_t dimensions() const { return part == Part::kSwing ? 3 : part == Part::kTwist ? 2 : 9; }
  // The place of a rotation; dimensions() numbers.
  void Place(Quaternion rotation, double* place) const;
};

enum class PoseBasis : std::uint8_t {
  kGaussian,   // exp(-(d / radius)^2)
  kThinPlate,  // d^2 log d
  kLinear,     // d
};

struct PoseSettings {
  PoseSpace space;
  PoseBasis basis = PoseBasis::kGaussian;
  double radius = 0;          // of kGaussian, radians; 0: the mean distance of poses from their nearest other
  double regularization = 0;  // at least 0
  bool normalize = false;     // negative weights become 0, and then all are divided by their sum
};

class PoseWeights {
 public:
  // names: of the poses, for messages; as many as rotations. Errors: no pose, two poses at the same place
  // (named), too few for the basis (linear and thin plate need two), a matrix that cannot be solved, a
  // radius or regularization that is not finite or below 0.
  static Result<PoseWeights> Bind(const PoseSettings& settings, std::span<const Quaternion> poses,
                                  std::span<const std::string> names);
  std::size_t pose_count() const { return count_; }
  // weights: pose_count() numbers.
  void Run(Quaternion rotation, std::span<double> weights) const noexcept;

 private:
  double Phi(double distance) const noexcept;
  double DistanceTo(std::size_t pose, const double* place) const noexcept;

  PoseSettings settings_;
  std::size_t count_ = 0;
  std::vector<double> places_;  // dimensions() a pose
  std::vector<double> solved_;  // count x count, rows: the pose whose function it is
};

}  // namespace kpsa::engine
