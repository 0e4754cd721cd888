#include "nodes/kernels/sculpt.h"

#include <algorithm>
#include <cmath>

#include "base/check.h"
#include "nodes/kernels/weights.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kSculptGrain = 2048;

// How far along `direction` a point inside the unit sphere leaves it.
double Exit(Double3 p, Double3 direction) {
  const double along = Dot(p, direction), inside = 1 - Dot(p, p);
  return std::sqrt(along * along + std::max(inside, 0.0)) - along;
}

}  // namespace

Double3 SculptPoint(const SculptShape& shape, Double3 p) {
  const double r = Length(p), d = shape.dropoff_distance;
  const bool linear = shape.dropoff == SculptDropoff::kLinear && d > 0;
  if (shape.mode == SculptMode::kStretch) {
    if (!(r < 1 + d) || shape.stretch == Double3()) return p;
    const double fade = r <= 1 || !linear ? 1 : 1 - (r - 1) / d;
    const double exit = Exit(r <= 1 ? p : p * (1 / r), shape.stretch);
    return p + shape.stretch * std::min(exit * fade, shape.max_displacement);
  }
  if (!(r > 0)) return p;
  double way = 0;
  if (shape.mode == SculptMode::kFlip) {
    if (linear && r < 1 + d) way = 1 + r / (1 + d) * d - r;
    if (!linear && r < 1) way = 1 - r;
  } else if (std::fabs(r - 1) < d) {
    way = (1 - r) * (linear ? 1 - std::fabs(r - 1) / d : 1);
  }
  way = std::clamp(way, -shape.max_displacement, shape.max_displacement);
  return p * (1 + way / r);
}

SculptKernel::SculptKernel(std::span<const Index> out_points, std::span<const float> point_weights) {
  KPSA_CHECK(point_weights.empty() || point_weights.size() == out_points.size());
  weights_.assign(out_points.size(), 1.0f);
  if (!point_weights.empty()) weights_.assign(point_weights.begin(), point_weights.end());
}

void SculptKernel::Run(const Inputs& inputs, ConstPointsView in, PointsView out,
                       const Parallel* parallel) const noexcept {
  KPSA_CHECK_EQ(in.count, point_count());
  KPSA_CHECK_EQ(out.count, point_count());
  CopyPoints(in, out);
  Matrix4 sphere_from_stage;
  const float envelope = static_cast<float>(inputs.envelope);
  if (envelope == 0 || !Invert(inputs.stage_from_sphere, &sphere_from_stage)) return;
  ForRanges(parallel, point_count(), kSculptGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const double w = weights_[i] * envelope;
      if (w == 0) continue;
      const Double3 local = TransformPoint(sphere_from_stage, {in.x[i], in.y[i], in.z[i]});
      const Double3 way = SculptPoint(inputs.shape, local) - local;
      if (way == Double3()) continue;  // to the bit
      const Double3 moved = TransformVector(inputs.stage_from_sphere, way);
      out.x[i] = static_cast<float>(in.x[i] + moved.x * w);
      out.y[i] = static_cast<float>(in.y[i] + moved.y * w);
      out.z[i] = static_cast<float>(in.z[i] + moved.z * w);
    }
  });
}

}  // namespace kpsa::engine
