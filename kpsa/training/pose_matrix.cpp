#include "kpsa/training/pose_matrix.h"

#include <algorithm>
#include <utility>

#include "base/check.h"
#include "base/parallel.h"

namespace kpsa::engine {

std::span<float> PoseMatrix::AddPose() {
  KPSA_CHECK(!centered_);
  const std::span<float> pose = Grow();
  std::ranges::fill(pose, 0.0f);  // a pose that was taken away may have been there
  return pose;
}

void PoseMatrix::Append(const PoseMatrix& other) {
  KPSA_CHECK(layout_ == other.layout_ && (centered_ == other.centered_ || other.poses_ == 0));
  for (std::size_t t = 0; t < other.poses_; ++t) Append(other, t);
}

void PoseMatrix::Append(const PoseMatrix& other, std::size_t pose) {
  std::ranges::copy(other.row(pose), Grow().begin());
  origins_.back() = other.origins_[pose];
}

void PoseMatrix::Append(PoseMatrix&& other) {
  KPSA_CHECK(layout_ == other.layout_ && (centered_ == other.centered_ || other.poses_ == 0));
  for (std::size_t t = 0; t < other.poses_; ++t) {
    Append(other, t);
    if (t % kBlockPoses + 1 == kBlockPoses) other.blocks_[t / kBlockPoses] = {};
  }
  other.Truncate(0);
}

PoseMatrix PoseMatrix::TakeEvery(std::size_t count) {
  PoseMatrix taken(layout_);
  taken.centered_ = centered_;
  std::size_t kept = 0;
  for (std::size_t t = 0; t < poses_; ++t) {
    const std::span<const float> from = std::as_const(*this).row(t);
    if (t % count == count - 1) {
      taken.Append(*this, t);
    } else {
      if (kept != t) std::ranges::copy(from, row(kept).begin());
      origins_[kept++] = origins_[t];
    }
  }
  Truncate(kept);
  return taken;
}

PoseMatrix PoseMatrix::TakeAfter(std::size_t poses) {
  PoseMatrix taken(layout_);
  taken.centered_ = centered_;
  for (std::size_t t = poses; t < poses_; ++t) taken.Append(*this, t);
  Truncate(poses);
  return taken;
}

void PoseMatrix::Truncate(std::size_t poses) {
  poses_ = std::min(poses_, poses);
  blocks_.resize((poses_ + kBlockPoses - 1) / kBlockPoses);
  origins_.resize(poses_);
}

std::span<float> PoseMatrix::Grow() {
  if (poses_ % kBlockPoses == 0) blocks_.push_back(AlignedFloats::Untouched(kBlockPoses * columns()));
  origins_.push_back(0);
  return row(poses_++);
}

std::span<float> PoseMatrix::row(std::size_t pose) {
  KPSA_DCHECK(pose / kBlockPoses < blocks_.size());
  return {blocks_[pose / kBlockPoses].data() + pose % kBlockPoses * columns(), columns()};
}

std::span<const float> PoseMatrix::row(std::size_t pose) const {
  return const_cast<PoseMatrix*>(this)->row(pose);
}

Eigen::VectorXd PoseMatrix::Mean() const {
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(columns()));
  if (poses_ == 0) return mean;
  ParallelFor(columns(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t pose = 0; pose < poses_; ++pose) {
      const std::span<const float> values = row(pose);
      for (std::size_t i = begin; i < end; ++i)
        mean[static_cast<Eigen::Index>(i)] += static_cast<double>(values[i]);
    }
  });
  return mean / static_cast<double>(poses_);
}

void PoseMatrix::Subtract(const Eigen::VectorXd& mean) {
  KPSA_CHECK_EQ(static_cast<std::size_t>(mean.size()), columns());
  KPSA_CHECK(!centered_);
  ParallelFor(poses_, 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t pose = begin; pose < end; ++pose) {
      const std::span<float> values = row(pose);
      for (std::size_t i = 0; i < values.size(); ++i) {
        values[i] = static_cast<float>(static_cast<double>(values[i]) - mean[static_cast<Eigen::Index>(i)]);
      }
    }
  });
  centered_ = true;
}

MeanShape MeanShapeOf(const PoseLayout& layout, const Eigen::VectorXd& mean) {
  MeanShape shape;
  Double3 lo{1e300, 1e300, 1e300}, hi{-1e300, -1e300, -1e300};
  for (std::size_t i = 0; i < layout.points + layout.stage_points; ++i) {
    const auto at = static_cast<Eigen::Index>(3 * i);
    shape.positions.push_back({mean[at], mean[at + 1], mean[at + 2]});
    for (int a = 0; a < 3 && i < layout.points; ++a) {
      lo[a] = std::min(lo[a], shape.positions[i][a]);
      hi[a] = std::max(hi[a], shape.positions[i][a]);
    }
  }
  shape.diagonal = Length(hi - lo);
  return shape;
}

}  // namespace kpsa::engine
