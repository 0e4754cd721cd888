// A deformable sheet with local controls, for tests of the subspace mathematics: no graph, any number of
// points.
#pragma once

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "base/types.h"
#include "kpsa/training/pca.h"
#include "kpsa/training/pose_matrix.h"

namespace kpsa::engine::test {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Points of a square grid of about `count` points, 0.5 m wide, in a blockwise spatial order (so that runs of
// 128 points lie together), and controls: local bumps with a direction each, a bend and a twist that move
// everything nonlinearly. Lengths in metres.
class Sheet {
 public:
  Sheet(std::size_t count, std::size_t controls, unsigned seed) : controls_(controls) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> unit(-1, 1);
    const auto side = static_cast<std::size_t>(std::ceil(std::sqrt(static_cast<double>(count)) / 8)) * 8;
    for (std::size_t block = 0; block < side * side / 64; ++block) {
      for (std::size_t i = 0; i < 64 && rest_.size() < count; ++i) {
        const std::size_t x = block % (side / 8) * 8 + i % 8, y = block / (side / 8) * 8 + i / 8;
        rest_.push_back({0.5 * static_cast<double>(x) / static_cast<double>(side),
                         0.5 * static_cast<double>(y) / static_cast<double>(side), 0});
      }
    }
    for (std::size_t k = 0; k < controls; ++k) {
      center_.push_back({0.25 + 0.25 * unit(random), 0.25 + 0.25 * unit(random), 0});
      direction_.push_back({0.01 * unit(random), 0.01 * unit(random), 0.02 * unit(random)});
      radius_.push_back(0.06 + 0.04 * std::fabs(unit(random)));
    }
  }

  std::size_t points() const { return rest_.size(); }
  std::size_t controls() const { return controls_ + 2; }  // the bumps, then bend and twist
  const std::vector<Double3>& rest() const { return rest_; }
  double diagonal() const { return 0.5 * std::sqrt(2.0); }

  Double3 Point(std::size_t i, const std::vector<double>& values) const {
    Double3 p = rest_[i];
    for (std::size_t k = 0; k < controls_; ++k) {
      const Double3 d = rest_[i] - center_[k];
      const double q = Dot(d, d) / (radius_[k] * radius_[k]);
      if (q < 9) p = p + direction_[k] * (values[k] * std::exp(-q));
    }
    const double bend = 0.3 * values[controls_], twist = 0.3 * values[controls_ + 1] * (rest_[i].x - 0.25);
    const double a = bend * p.y, c = std::cos(a), s = std::sin(a);
    p = {p.x, p.y * c - p.z * s, p.y * s + p.z * c};
    return {p.x, 0.25 + (p.y - 0.25) * std::cos(twist) - p.z * std::sin(twist),
            (p.y - 0.25) * std::sin(twist) + p.z * std::cos(twist)};
  }

  // A few controls at a time, as training mixtures are.
  std::vector<double> RandomControls(std::mt19937* random, double amplitude = 1) const {
    std::uniform_real_distribution<double> unit(-1, 1);
    std::vector<double> values(controls(), 0.0);
    for (double& value : values) {
      if ((*random)() % 4 == 0) value = amplitude * unit(*random);
    }
    return values;
  }

  // Appends a pose: outputs, the same points before bend and twist if the layout has stage points, controls
  // as scalars.
  void Append(const std::vector<double>& values, PoseMatrix* poses) const {
    const PoseLayout& layout = poses->layout();
    const std::span<float> row = poses->AddPose();
    std::vector<double> before = values;
    before[controls_] = before[controls_ + 1] = 0;
    for (std::size_t i = 0; i < points(); ++i) {
      const Double3 p = Point(i, values), q = layout.stage_points > 0 ? Point(i, before) : Double3();
      for (int c = 0; c < 3; ++c) {
        row[3 * i + static_cast<std::size_t>(c)] = static_cast<float>(p[c]);
        if (layout.stage_points > 0)
          row[layout.stage_begin() + 3 * i + static_cast<std::size_t>(c)] = static_cast<float>(q[c]);
      }
    }
    for (std::size_t k = 0; k < layout.scalars; ++k)
      row[layout.scalar_begin() + k] = static_cast<float>(values[k]);
  }

  PoseLayout Layout(bool stages = false, bool scalars = false) const {
    return {points(), 3, stages ? points() : 0, scalars ? controls() : 0};
  }
  PoseMatrix RandomPoses(std::size_t count, unsigned seed, const PoseLayout& layout,
                         double amplitude = 1) const {
    PoseMatrix poses(layout);
    std::mt19937 random(seed);
    for (std::size_t t = 0; t < count; ++t) Append(RandomControls(&random, amplitude), &poses);
    return poses;
  }

 private:
  std::size_t controls_;
  std::vector<Double3> rest_, center_, direction_;
  std::vector<double> radius_;
};

// Poses of independent normal numbers.
inline PoseMatrix NoisePoses(std::size_t count, const PoseLayout& layout, unsigned seed) {
  PoseMatrix poses(layout);
  std::mt19937 random(seed);
  std::normal_distribution<float> normal;
  for (std::size_t t = 0; t < count; ++t) {
    for (float& value : poses.AddPose()) value = normal(random);
  }
  return poses;
}

}  // namespace kpsa::engine::test
