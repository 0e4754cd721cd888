#include "host/bench/point_errors.h"

#include <algorithm>
#include <cmath>

namespace kpsa::engine {
namespace {

constexpr double kSmallest = 1e-12;  // metres; what is nearer counts as equal
constexpr double kStep = 1.02;       // ratio of neighbouring bins
constexpr std::size_t kBins = 2400;  // up to 1e-12 * 1.02^2400, 4e8 m

std::size_t Bin(double distance) {
  if (!(distance > kSmallest)) return 0;
  const double bin = std::ceil(std::log(distance / kSmallest) / std::log(kStep));
  return static_cast<std::size_t>(std::min(bin, static_cast<double>(kBins - 1)));
}

}  // namespace

double PointErrors::AddFrame(const Evaluator& exact, const Evaluator& other) {
  bins_.resize(kBins, 0);
  double worst = 0;
  std::size_t at = 0;
  frame_rms_ = 0;
  for (Index o = 0; o < outputs_; ++o) {
    const double before = squares_;
    const ConstPointsView a = exact.Points(o), b = other.Points(o);
    if (frames_ == 0)
      first_.resize(at + 3 * a.count), sum_.resize(first_.size()), square_sum_.resize(at / 3 + a.count);
    for (std::size_t i = 0; i < a.count; ++i, at += 3) {
      const double p[3] = {a.x[i], a.y[i], a.z[i]}, q[3] = {b.x[i], b.y[i], b.z[i]};
      double square = 0, moved = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        square += (p[c] - q[c]) * (p[c] - q[c]);
        low_[c] = std::min(low_[c], p[c]), high_[c] = std::max(high_[c], p[c]);
        if (frames_ == 0) first_[at + c] = p[c];
        const double d = p[c] - first_[at + c];
        sum_[at + c] += d;
        moved += d * d;
      }
      square_sum_[at / 3] += moved;
      const double distance = std::isfinite(square) ? std::sqrt(square) : HUGE_VAL;
      worst = std::max(worst, distance);
      squares_ += distance * distance;
      ++bins_[Bin(distance)];
    }
    if (a.count > 0)
      frame_rms_ = std::max(frame_rms_, std::sqrt((squares_ - before) / static_cast<double>(a.count)));
  }
  count_ += at / 3;
  ++frames_;
  return worst;
}

double PointErrors::Motion() const {
  double motion = merged_motion_;
  const auto frames = static_cast<double>(std::max<std::size_t>(1, frames_));
  for (std::size_t i = 0; i < square_sum_.size(); ++i) {
    double mean_square = 0;
    for (std::size_t c = 0; c < 3; ++c) mean_square += sum_[3 * i + c] * sum_[3 * i + c] / frames;
    motion += std::max(0.0, square_sum_[i] - mean_square);
  }
  return motion;
}

void PointErrors::Merge(const PointErrors& later) {
  merged_motion_ = Motion() + later.Motion();
  first_.clear(), sum_.clear(), square_sum_.clear();
  squares_ += later.squares_;
  count_ += later.count_;
  bins_.resize(kBins, 0);
  for (std::size_t b = 0; b < later.bins_.size(); ++b) bins_[b] += later.bins_[b];
  for (int c = 0; c < 3; ++c)
    low_[c] = std::min(low_[c], later.low_[c]), high_[c] = std::max(high_[c], later.high_[c]);
}

double PointErrors::rms() const {
  return count_ == 0 ? 0 : std::sqrt(squares_ / static_cast<double>(count_));
}

double PointErrors::Percentile(double share) const {
  std::uint64_t seen = 0;
  const auto wanted = static_cast<std::uint64_t>(std::ceil(share * static_cast<double>(count_)));
  for (std::size_t b = 0; b < bins_.size(); ++b) {
    seen += bins_[b];
    if (seen >= wanted && seen > 0) return b == 0 ? 0 : kSmallest * std::pow(kStep, static_cast<double>(b));
  }
  return 0;
}

double PointErrors::motion_rms() const {
  return count_ == 0 ? 0 : std::sqrt(Motion() / static_cast<double>(count_));
}

double PointErrors::diagonal() const {
  double square = 0;
  for (int c = 0; c < 3; ++c) {
    if (high_[c] > low_[c]) square += (high_[c] - low_[c]) * (high_[c] - low_[c]);
  }
  return std::sqrt(square);
}

}  // namespace kpsa::engine
