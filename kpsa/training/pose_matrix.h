// The training poses: a matrix of T poses by D columns in float32, held once, in blocks of poses (growing
// copies nothing). Columns of a pose, all interleaved by point:
//   [0, cN)        the outputs: N points of c components (c = 3: x0 y0 z0 x1 ...; c = 1: scalars, colours of a channel)
//   [cN, cN + 3P)  P points of earlier stages that may become cues
//   [cN + 3P, D)   S scalars that may become cues (joint rotations, weights, controls)
// Values are in scene units, as the graph gives them; Center makes them differences from the mean.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/points.h"

namespace kpsa::engine {

struct PoseLayout {
  std::size_t points = 0;        // N, of all meshes, one after the other
  int components = 3;            // c: 3 or 1
  std::size_t stage_points = 0;  // P
  std::size_t scalars = 0;       // S
  std::size_t products = 0;  // of which so many are products of others (kpsa/training/cue_products.h), and
  Index relative_begin = 0;  // after these, matrices of twelve entries, relative to the space
  std::size_t outputs() const { return points * static_cast<std::size_t>(components); }
  std::size_t stage_begin() const { return outputs(); }
  std::size_t scalar_begin() const { return outputs() + 3 * stage_points; }
  std::size_t columns() const { return scalar_begin() + scalars; }  // D
  std::size_t products_begin() const { return relative_begin - products; }
  friend bool operator==(const PoseLayout&, const PoseLayout&) = default;
};

// Not thread-safe while it grows; rows may be filled from several threads.
class PoseMatrix {
 public:
  static constexpr std::size_t kBlockPoses = 64;

  explicit PoseMatrix(PoseLayout layout) : layout_(layout) {}
  const PoseLayout& layout() const { return layout_; }
  std::size_t poses() const { return poses_; }  // T
  std::size_t columns() const { return layout_.columns(); }

  // Appends a pose of zeros and returns its D values for the caller to fill. Earlier rows stay where they
  // are.
  std::span<float> AddPose();
  std::span<float> row(std::size_t pose);
  std::span<const float> row(std::size_t pose) const;
  // A number that stays with a pose wherever it goes, 0 if none was given (PoseRecorder's, of what it recorded).
  std::uint32_t origin(std::size_t pose) const { return origins_[pose]; }
  void set_origin(std::size_t pose, std::uint32_t origin) { origins_[pose] = origin; }
  // The poses [block * kBlockPoses, ...) are contiguous, D floats apart.
  std::size_t blocks() const { return blocks_.size(); }

  // Mean of every column over the poses, summed in double. [D]
  Eigen::VectorXd Mean() const;
  // Subtracts a mean in place (double difference, rounded once). The matrix remembers that it is centred.
  void Subtract(const Eigen::VectorXd& mean);
  bool centered() const { return centered_; }
  // The poses of another matrix of the same layout, both centred with the same mean, or neither.
  void Append(const PoseMatrix& other);
  void Append(PoseMatrix&& other);  // which is empty then; its memory is freed on the way
  void Append(const PoseMatrix& other, std::size_t pose);  // one of them
  // Keeps the first poses.
  void Truncate(std::size_t poses);
  // Likewise; the others are taken away.
  PoseMatrix TakeAfter(std::size_t poses);
  // Takes the last of so many poses away, again and again.
  PoseMatrix TakeEvery(std::size_t count);

 private:
  std::span<float> Grow();

  PoseLayout layout_;
  std::size_t poses_ = 0;
  bool centered_ = false;
  std::vector<AlignedFloats> blocks_;
  std::vector<std::uint32_t> origins_;  // by pose
};

// The places of all points on the average, those at stages behind the outputs', and the diagonal of the box
// around the outputs'. mean: of all columns.
struct MeanShape {
  std::vector<Double3> positions;
  double diagonal = 0;
};
MeanShape MeanShapeOf(const PoseLayout& layout, const Eigen::VectorXd& mean);

}  // namespace kpsa::engine
