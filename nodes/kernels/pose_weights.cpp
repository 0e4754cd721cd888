#include "nodes/kernels/pose_weights.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/matrix.h"
#include "base/scalar_math.h"
#include "nodes/kernels/transform_math.h"

namespace kpsa::engine {
namespace {

constexpr double kSame = 1e-5;      // chords: poses that nobody tells apart
constexpr double kSingular = 1e-9;  // what is left of the identity after a solve

// a <- a^-1 by Gauss and Jordan with partial pivoting; rows of n numbers. False where a is singular.
bool InvertInPlace(std::size_t n, std::vector<double>* a) {
  std::vector<double> left = *a, right(n * n, 0.0);
  for (std::size_t i = 0; i < n; ++i) right[i * n + i] = 1;
  for (std::size_t c = 0; c < n; ++c) {
    std::size_t pivot = c;
    for (std::size_t r = c + 1; r < n; ++r) {
      if (std::fabs(left[r * n + c]) > std::fabs(left[pivot * n + c])) pivot = r;
    }
    const double head = left[pivot * n + c];
    if (head == 0 || !std::isfinite(head)) return false;
    for (std::size_t k = 0; k < n; ++k) {
      std::swap(left[pivot * n + k], left[c * n + k]);
      std::swap(right[pivot * n + k], right[c * n + k]);
    }
    for (std::size_t k = 0; k < n; ++k) left[c * n + k] /= head, right[c * n + k] /= head;
    for (std::size_t r = 0; r < n; ++r) {
      const double factor = left[r * n + c];
      if (r == c || factor == 0) continue;
      for (std::size_t k = 0; k < n; ++k) {
        left[r * n + k] -= factor * left[c * n + k];
        right[r * n + k] -= factor * right[c * n + k];
      }
    }
  }
  // How good it is
  double worst = 0;
  for (std::size_t r = 0; r < n; ++r) {
    for (std::size_t c = 0; c < n; ++c) {
      double sum = r == c ? -1 : 0;
      for (std::size_t k = 0; k < n; ++k) sum += (*a)[r * n + k] * right[k * n + c];
      worst = std::max(worst, std::fabs(sum));
    }
  }
  *a = std::move(right);
  return worst < kSingular;
}

}  // namespace

void PoseSpace::Place(Quaternion rotation, double* place) const {
  if (part == Part::kTwist) {
    const double angle = TwistAngle(DecomposeSwingTwist(rotation, twist_axis).twist, twist_axis);
    SinCos(angle, &place[1], &place[0]);
    return;
  }
  const Matrix4 m = RotationFromQuaternion(rotation);
  if (part == Part::kSwing) {
    const Double3 axis = TransformVector(m, twist_axis);
    for (int a = 0; a < 3; ++a) place[a] = axis[a];
    return;
  }
  // |A - B| of rotation matrices is sqrt(2) times the chord of the angle between them
  const double scale = std::sqrt(0.5);
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) place[3 * r + c] = m(r, c) * scale;
  }
}

double PoseWeights::Phi(double distance) const noexcept {
  switch (settings_.basis) {
    case PoseBasis::kGaussian: {
      const double t = distance / settings_.radius;
      return Exp(-t * t);
    }
    case PoseBasis::kThinPlate:
      return distance > 0 ? distance * distance * Log(distance) : 0;
    case PoseBasis::kLinear:
      break;
  }
  return distance;
}

double PoseWeights::DistanceTo(std::size_t pose, const double* place) const noexcept {
  const std::size_t n = settings_.space.dimensions();
  double sum = 0;
  for (std::size_t k = 0; k < n; ++k) {
    const double way = place[k] - places_[pose * n + k];
    sum += way * way;
  }
  return std::sqrt(sum);
}

Result<PoseWeights> PoseWeights::Bind(const PoseSettings& settings, std::span<const Quaternion> poses,
                                      std::span<const std::string> names) {
  if (poses.empty()) return Status::Invalid("there is no pose");
  if (!(settings.regularization >= 0) || !std::isfinite(settings.regularization))
    return Status::Invalid("regularization: expected a number of at least 0, found {}",
                           settings.regularization);
  if (!(settings.radius >= 0) || !std::isfinite(settings.radius))
    return Status::Invalid("radius: expected an angle of at least 0, found {}", settings.radius);
  PoseWeights weights;
  weights.settings_ = settings;
  weights.count_ = poses.size();
  const std::size_t n = settings.space.dimensions(), count = poses.size();
  if (count < 2 && settings.basis != PoseBasis::kGaussian)
    return Status::Invalid("one pose: linear and thin plate functions need two, a Gaussian does with one");
  weights.places_.resize(n * count);
  for (std::size_t i = 0; i < count; ++i) settings.space.Place(poses[i], &weights.places_[n * i]);
  std::vector<double> nearest(count, std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const double distance = weights.DistanceTo(j, &weights.places_[n * i]);
      if (distance < kSame) {
        constexpr const char* kParts[] = {"", ", as far as swing is concerned",
                                          ", as far as twist is concerned"};
        return Status::Invalid("the poses \"{}\" and \"{}\" are the same rotation{}", names[j], names[i],
                               kParts[static_cast<std::size_t>(settings.space.part)]);
      }
      nearest[i] = std::min(nearest[i], distance);
      nearest[j] = std::min(nearest[j], distance);
    }
  }
  if (settings.radius == 0) {
    double sum = 0;
    for (const double distance : nearest) sum += distance;
    weights.settings_.radius = count == 1 ? 1 : sum / static_cast<double>(count);
  }
  weights.solved_.resize(count * count);
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = 0; j < count; ++j) {
      weights.solved_[i * count + j] = weights.Phi(weights.DistanceTo(j, &weights.places_[n * i])) +
                                       (i == j ? settings.regularization : 0);
    }
  }
  if (!InvertInPlace(count, &weights.solved_)) {
    return Status::Invalid(
        "these {} poses have no stable interpolation of this kind: use another one, a smaller radius, or "
        "some "
        "regularization",
        count);
  }
  return weights;
}

void PoseWeights::Run(Quaternion rotation, std::span<double> weights) const noexcept {
  double place[PoseSpace::kMost];
  settings_.space.Place(rotation, place);
  std::fill(weights.begin(), weights.end(), 0.0);
  for (std::size_t i = 0; i < count_; ++i) {
    const double phi = Phi(DistanceTo(i, place));
    for (std::size_t j = 0; j < count_; ++j) weights[j] += phi * solved_[i * count_ + j];
  }
  if (!settings_.normalize) return;
  double sum = 0;
  for (double& weight : weights) {
    weight = std::max(weight, 0.0);
    sum += weight;
  }
  if (!(sum > 0)) return;
  for (double& weight : weights) weight /= sum;
}

}  // namespace kpsa::engine
