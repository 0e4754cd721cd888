#include "kpsa/calibration.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace kpsa {
namespace {

constexpr double kShareOfHits = 2;  // in alphas: violations among the hits
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// u in [0, 1] with smoothstep(u) = w.
double InverseSmoothstep(double w) {
  double lo = 0, hi = 1;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (lo + hi);
    (middle * middle * (3 - 2 * middle) < w ? lo : hi) = middle;
  }
  return hi;
}

// The largest tau at which the pose does not violate: the blend then takes just enough of the full
// evaluation.
double LargestHarmless(const CalibrationPair& pair, double tolerance, double blend_start) {
  if (std::isnan(pair.score) || std::isnan(pair.error)) return 0;
  if (pair.error <= tolerance) return kInfinity;
  const double u = pair.error == kInfinity ? 1 : InverseSmoothstep(1 - tolerance / pair.error);
  return pair.score / (blend_start + u * (1 - blend_start));
}

}  // namespace

double EmittedError(const CalibrationPair& pair, const SoftCacheThreshold& threshold) {
  const double weight = FullWeight(pair.score, threshold);
  return weight == 1 ? 0 : (1 - weight) * pair.error;
}

Calibration Calibrate(std::span<const CalibrationPair> pairs, double tolerance, double alpha,
                      double blend_start) {
  Calibration result;
  const double n = static_cast<double>(pairs.size());
  result.poses = pairs.size();
  result.alpha = alpha;
  result.threshold.blend_start = std::clamp(blend_start, 1e-3, 1.0);
  result.attainable_alpha = std::max(alpha, 1 / (n + 1));
  result.enough_poses = alpha * (n + 1) >= 1;
  if (!(tolerance > 0)) return result;  // never a hit: the exact rig
  if (tolerance == kInfinity) {
    result.threshold.tau = kInfinity;
    result.hit_rate = result.accepted_rate = 1;
    return result;
  }
  if (pairs.empty()) {
    result.warning = "there are no calibration poses, so nothing is ever a hit";
    return result;
  }
  if (!result.enough_poses) {
    result.warning = fmt::format(
        "{} calibration poses cannot promise a violation rate of {:g}; the threshold keeps {:.3g} "
        "({})",
        pairs.size(), alpha, result.attainable_alpha,
        alpha > 0 ? fmt::format("at least {:.0f} poses are needed", std::ceil(1 / alpha - 1))
                  : "no number of poses can");
  }

  // A pose violates where tau exceeds its limit, so the limit number k + 1 admits k violations
  std::vector<double> limits;
  double largest_score = 0;
  for (const CalibrationPair& pair : pairs) {
    limits.push_back(LargestHarmless(pair, tolerance, result.threshold.blend_start));
    if (std::isfinite(pair.score)) largest_score = std::max(largest_score, pair.score);
  }
  std::sort(limits.begin(), limits.end());
  const double admitted = std::floor(result.attainable_alpha * (n + 1) * (1 + 1e-12) - 1);
  const double cap = largest_score / result.threshold.blend_start * (1 + 1e-12);
  const auto limit = [&](std::size_t k) { return k < limits.size() ? std::min(limits[k], cap) : cap; };
  const auto hits_below = [&](double tau) {
    const double tau_lo = tau * result.threshold.blend_start;
    return std::count_if(pairs.begin(), pairs.end(),
                         [&](const CalibrationPair& pair) { return pair.score <= tau_lo; });
  };
  auto k = static_cast<std::size_t>(std::clamp(admitted, 0.0, n));
  const double share = kShareOfHits * result.attainable_alpha;
  while (k > 0 && static_cast<double>(k) > share * static_cast<double>(hits_below(limit(k)))) --k;
  const double tau = limit(k);
  if (tau > 0) result.threshold.tau = tau;
  if (!(tau > 0)) result.warning = "no threshold keeps the violation rate, so nothing is ever a hit";

  // What that means on these poses; the margin forgives the rounding of the limit itself
  std::size_t hits = 0, accepted = 0;
  for (const CalibrationPair& pair : pairs) {
    const double weight = std::isnan(pair.score) ? 1 : FullWeight(pair.score, result.threshold);
    hits += weight == 0;
    accepted += weight < 1;
    result.violations += weight < 1 && !(EmittedError(pair, result.threshold) <= tolerance * (1 + 1e-9));
  }
  result.hit_rate = static_cast<double>(hits) / n;
  result.accepted_rate = static_cast<double>(accepted) / n;
  return result;
}

}  // namespace kpsa
