#include "nodes/kernels/shrink_wrap.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/check.h"
#include "base/scalar_math.h"
#include "nodes/kernels/weights.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kShrinkWrapGrain = 256;

std::size_t Padded(std::size_t floats) { return PaddedCount(floats); }

Double3 At(ConstPointsView points, std::size_t i) { return {points.x[i], points.y[i], points.z[i]}; }

std::vector<Index> Moving(std::span<const Index> points, std::span<const float> weights) {
  std::vector<Index> moving;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (weights.empty() || weights[i] != 0) moving.push_back(points[i]);
  }
  return moving;
}

PointsView ViewIn(float* floats, std::size_t count) {
  const std::size_t row = Padded(count);
  return {floats, floats + row, floats + 2 * row, count};
}

}  // namespace

std::vector<Index> ShrinkWrapDemand(const ShrinkWrapSettings& settings, const Topology& own,
                                    std::span<const Index> out_points, std::span<const float> point_weights) {
  std::vector<Index> demand(out_points.begin(), out_points.end());
  if (settings.projection != ShrinkWrapSettings::Projection::kNormals) return demand;
  const std::vector<Index> rings = NormalsDemand(own, Moving(out_points, point_weights));
  demand.insert(demand.end(), rings.begin(), rings.end());
  std::sort(demand.begin(), demand.end());
  demand.erase(std::unique(demand.begin(), demand.end()), demand.end());
  return demand;
}

ShrinkWrapKernel::ShrinkWrapKernel(const ShrinkWrapSettings& settings, const Topology& target,
                                   MovingSurface surface, const Matrix4& stage_from_target,
                                   const Topology& own, std::span<const Index> out_points,
                                   std::span<const Index> in_points, std::span<const float> point_weights)
    : settings_(settings),
      stage_from_target_(stage_from_target),
      surface_(std::move(surface)),
      in_count_(in_points.size()),
      around_offsets_(target.point_triangles().offsets.begin(), target.point_triangles().offsets.end()),
      around_(target.point_triangles().values.begin(), target.point_triangles().values.end()),
      entries_(PositionsIn(in_points, out_points)) {
  KPSA_CHECK(point_weights.empty() || point_weights.size() == out_points.size());
  weights_.assign(out_points.size(), 1.0f);
  if (!point_weights.empty()) weights_.assign(point_weights.begin(), point_weights.end());
  if (settings_.projection != ShrinkWrapSettings::Projection::kNormals) return;
  const std::vector<Index> moving = Moving(out_points, point_weights);
  normals_.emplace(own, moving, in_points);
  Index next = 0;
  for (const float weight : weights_) normal_of_.push_back(weight != 0 ? next++ : kNoIndex);
}

std::size_t ShrinkWrapKernel::ScratchFloats() const {
  std::size_t floats = MovesTarget() ? 3 * Padded(surface_.point_count()) : 0;
  if (normals_.has_value()) floats += 3 * Padded(normals_->point_count()) + normals_->ScratchFloats();
  return floats;
}

Double3 ShrinkWrapKernel::FaceNormal(const TriangleTree& target, Index triangle) const noexcept {
  const Index* corner = &target.triangles()[3 * std::size_t{triangle}];
  const Double3 a = At(target.points(), corner[0]);
  return UnitOrZero(Cross(At(target.points(), corner[1]) - a, At(target.points(), corner[2]) - a));
}

Double3 ShrinkWrapKernel::Pseudonormal(const TriangleTree& target, const SurfacePoint& place) const noexcept {
  const Index* corner = &target.triangles()[3 * std::size_t{place.triangle}];
  Index named[3];
  int count = 0;
  for (int k = 0; k < 3; ++k) {
    if (place.weights[k] != 0) named[count++] = corner[k];
  }
  if (count == 3) return FaceNormal(target, place.triangle);
  Double3 sum;
  for (Index e = around_offsets_[named[0]]; e < around_offsets_[named[0] + 1]; ++e) {
    const Index* other = &target.triangles()[3 * std::size_t{around_[e]}];
    const Double3 normal = FaceNormal(target, around_[e]);
    if (count == 2) {
      const bool shares = other[0] == named[1] || other[1] == named[1] || other[2] == named[1];
      if (shares) sum = sum + normal;
      continue;
    }
    const int k = other[0] == named[0] ? 0 : other[1] == named[0] ? 1 : 2;
    const Double3 own = At(target.points(), other[k]);
    const double cosine = Dot(UnitOrZero(At(target.points(), other[(k + 1) % 3]) - own),
                              UnitOrZero(At(target.points(), other[(k + 2) % 3]) - own));
    sum = sum + normal * Acos(cosine);
  }
  return UnitOrZero(sum);
}

bool ShrinkWrapKernel::Stays(double signed_distance, double offset) const noexcept {
  if (settings_.side == ShrinkWrapSettings::Side::kOutside) return signed_distance >= offset;
  if (settings_.side == ShrinkWrapSettings::Side::kInside) return signed_distance <= offset;
  return false;
}

std::optional<Double3> ShrinkWrapKernel::Nearest(const TriangleTree& target, Double3 p, double offset,
                                                 Index* near) const noexcept {
  const SurfacePoint place = target.Closest(p, std::numeric_limits<double>::infinity(), *near);
  if (place.triangle == kNoIndex) return std::nullopt;
  *near = place.triangle;
  if (offset == 0 && settings_.side == ShrinkWrapSettings::Side::kSurface) return place.point;
  const Double3 normal = Pseudonormal(target, place), away = p - place.point;
  const double distance = Length(away);
  const bool inside = Dot(away, normal) < 0;
  if (Stays(inside ? -distance : distance, offset)) return std::nullopt;
  // On the surface itself, there is only the normal to tell where outside is
  const Double3 outward =
      distance > 1e-7 * (1e-3 + Length(p)) ? away * ((inside ? -1 : 1) / distance) : normal;
  return place.point + outward * offset;
}

std::optional<Double3> ShrinkWrapKernel::AlongLine(const TriangleTree& target, Double3 p, Double3 line,
                                                   double offset, Index* near) const noexcept {
  if (settings_.reverse) line = line * -1.0;
  LineHit hit = target.FirstHit(p, line);
  if (settings_.bidirectional) {
    const LineHit back = target.FirstHit(p, line * -1.0);
    if (back.t < hit.t) {
      hit = back;
      line = line * -1.0;
    }
  }
  if (hit.triangle == kNoIndex)
    return settings_.closest_if_no_intersection ? Nearest(target, p, offset, near) : std::nullopt;
  // Towards the face from behind: the point is inside
  const bool inside = Dot(line, FaceNormal(target, hit.triangle)) > 0;
  if (Stays(inside ? -hit.t : hit.t, offset)) return std::nullopt;
  return p + line * (hit.t + (inside ? offset : -offset));
}

void ShrinkWrapKernel::Run(const Inputs& inputs, ConstPointsView in, PointsView out, std::span<float> scratch,
                           const Parallel* parallel) const {
  KPSA_CHECK_EQ(in.count, in_count_);
  KPSA_CHECK_EQ(out.count, point_count());
  KPSA_CHECK_EQ(inputs.target.count, surface_.point_count());
  KPSA_CHECK_LE(ScratchFloats(), scratch.size());
  const float envelope = static_cast<float>(inputs.envelope);
  if (envelope == 0) return GatherPoints(in, entries_, out);

  ConstPointsView placed = inputs.target;
  float* next = scratch.data();
  if (MovesTarget()) {
    const PointsView to = ViewIn(next, inputs.target.count);
    for (std::size_t i = 0; i < to.count; ++i) {
      const Double3 p = TransformPoint(stage_from_target_, At(inputs.target, i));
      to.x[i] = static_cast<float>(p.x);
      to.y[i] = static_cast<float>(p.y);
      to.z[i] = static_cast<float>(p.z);
    }
    placed = to;
    next += 3 * Padded(to.count);
  }
  const MovingSurface::Lease lease = surface_.At(placed);
  const TriangleTree& target = *lease;
  PointsView normals;
  if (normals_.has_value()) {
    normals = ViewIn(next, normals_->point_count());
    next += 3 * Padded(normals.count);
    normals_->Run(in, normals, {next, normals_->ScratchFloats()}, parallel);
  }

  ForRanges(parallel, point_count(), kShrinkWrapGrain, [&](std::size_t begin, std::size_t end) {
    Index near = kNoIndex;  // points that follow each other mostly lie beside each other
    for (std::size_t i = begin; i < end; ++i) {
      const float w = weights_[i] * envelope;
      const Double3 p = At(in, entries_[i]);
      std::optional<Double3> goal;
      if (w == 0) {
        goal = std::nullopt;
      } else if (settings_.projection == ShrinkWrapSettings::Projection::kClosest) {
        goal = Nearest(target, p, inputs.offset, &near);
      } else if (settings_.projection == ShrinkWrapSettings::Projection::kAxis) {
        goal = AlongLine(target, p, inputs.axis, inputs.offset, &near);
      } else {
        const Double3 normal = At(normals, normal_of_[i]);
        goal = std::isnan(normal.x + normal.y + normal.z)
                   ? normal
                   : AlongLine(target, p, normal, inputs.offset, &near);
      }
      const Double3 moved = goal.has_value() ? p + (*goal - p) * static_cast<double>(w) : p;
      out.x[i] = static_cast<float>(moved.x);
      out.y[i] = static_cast<float>(moved.y);
      out.z[i] = static_cast<float>(moved.z);
    }
  });
}

}  // namespace kpsa::engine
