#include "nodes/kernels/wrap.h"

#include <algorithm>
#include <cmath>

#include "base/check.h"
#include "nodes/kernels/weights.h"

namespace kpsa {
namespace {

constexpr std::size_t kWrapGrain = 1024;
constexpr double kFolded = 1e-6;  // of the tangents' lengths

// Any direction in the plane across a unit vector.
Double3 Across(Double3 normal) {
  int axis = 0;
  for (int a = 1; a < 3; ++a) {
    if (std::fabs(normal[a]) < std::fabs(normal[axis])) axis = a;
  }
  Double3 along;
  along[axis] = 1;
  const Double3 across = Cross(normal, along);
  return across * (1 / Length(across));
}

}  // namespace

WrapKernel::WrapKernel(WrapMode mode, const Topology& driver, std::span<const Double3> driver_rest,
                       const Matrix4& stage_from_driver, const WrapInfluences& influences,
                       ConstPointsView rest, std::span<const Index> out_points,
                       std::span<const Index> in_points, std::span<const float> point_weights)
    : mode_(mode),
      stage_from_driver_(stage_from_driver),
      in_count_(in_points.size()),
      offsets_(influences.offsets),
      shares_(influences.weights) {
  KPSA_CHECK_EQ(offsets_.size(), out_points.size() + 1);
  KPSA_CHECK(IsSortedSet(out_points, rest.count));
  KPSA_CHECK(point_weights.empty() || point_weights.size() == out_points.size());
  weights_.assign(out_points.size(), 1.0f);
  if (!point_weights.empty()) weights_.assign(point_weights.begin(), point_weights.end());
  const auto place_in = [](const std::vector<Index>& sorted, Index point) {
    const auto it = std::lower_bound(sorted.begin(), sorted.end(), point);
    KPSA_CHECK(it != sorted.end() && *it == point);
    return static_cast<Index>(it - sorted.begin());
  };
  const std::vector<Index> in(in_points.begin(), in_points.end());
  std::vector<Index> framed = influences.points;
  std::sort(framed.begin(), framed.end());
  framed.erase(std::unique(framed.begin(), framed.end()), framed.end());
  if (mode_ != WrapMode::kSnap) frames_ = DriverFrames(driver, driver_rest, framed, in_points);
  for (const Index point : influences.points) {
    entries_.push_back(place_in(in, point));
    const Index frame = mode_ == WrapMode::kSnap ? kNoIndex : place_in(framed, point);
    frame_of_.push_back(frame != kNoIndex && frames_.exists(frame) ? frame : kNoIndex);
  }

  // The rest side, by what computes the present one
  std::vector<Double3> points;
  for (const Index p : in_points) points.push_back(driver_rest[p]);
  std::vector<DriverFrame> frames(frames_.count());
  frames_.Run(points, frames);
  for (std::size_t i = 0; i < out_points.size(); ++i) {
    Rest one;
    Double3 normal;
    for (Index e = offsets_[i]; e < offsets_[i + 1]; ++e) {
      if (frame_of_[e] != kNoIndex) normal = normal + frames[frame_of_[e]].normal() * shares_[e];
    }
    if (Length(normal) > kFolded) {
      normal = normal * (1 / Length(normal));
      one.tangent = Across(normal);
      one.binormal = Cross(normal, one.tangent);
    }
    one.place = PlaceOf(i, one.tangent, one.binormal, points, frames);
    rest_.push_back(one);
  }
}

std::size_t WrapKernel::ScratchFloats() const {
  return (in_count_ * sizeof(Double3) + frames_.count() * sizeof(DriverFrame)) / sizeof(float);
}

WrapKernel::Place WrapKernel::PlaceOf(std::size_t point, Double3 tangent, Double3 binormal,
                                      std::span<const Double3> driver,
                                      std::span<const DriverFrame> frames) const noexcept {
  Place place;
  DriverFrame blend{};
  double framed = 0;
  for (Index e = offsets_[point]; e < offsets_[point + 1]; ++e) {
    const double share = shares_[e];
    place.anchor = place.anchor + driver[entries_[e]] * share;
    if (frame_of_[e] == kNoIndex) continue;
    const double* values = frames[frame_of_[e]].values;
    for (int k = 0; k < DriverFrame::kSize; ++k) blend.values[k] += values[k] * share;
    framed += share;
  }
  place.normal = blend.normal();
  const double length = Length(place.normal);
  if (framed == 0 || tangent == Double3() || length <= kFolded) return place;
  place.tangent = blend.Apply(tangent) * (1 / framed);
  place.binormal = blend.Apply(binormal) * (1 / framed);
  const Double3 n = place.normal * (1 / length);
  place.normal = n;
  place.turns = true;
  if (mode_ == WrapMode::kSurface) return place;
  // The rotation in the plane across n that is nearest to (tangent, binormal)
  const Double3 t = place.tangent, b = place.binormal;
  const Double3 turned = (t - n * Dot(n, t)) + Cross(b, n);
  const double size = Length(turned);
  if (size <= kFolded * (Length(t) + Length(b))) {
    place.turns = false;
    return place;
  }
  place.tangent = turned * (1 / size);
  place.binormal = Cross(n, place.tangent);
  return place;
}

void WrapKernel::Run(const Inputs& inputs, ConstPointsView in, PointsView out, std::span<float> scratch,
                     const Parallel* parallel) const noexcept {
  KPSA_CHECK_EQ(in.count, point_count());
  KPSA_CHECK_EQ(out.count, point_count());
  KPSA_CHECK_EQ(inputs.driver.count, in_count_);
  KPSA_CHECK_LE(ScratchFloats(), scratch.size());
  CopyPoints(in, out);
  const float envelope = static_cast<float>(inputs.envelope);
  if (envelope == 0) return;
  const std::span<Double3> driver(reinterpret_cast<Double3*>(scratch.data()), in_count_);
  const std::span<DriverFrame> frames(reinterpret_cast<DriverFrame*>(driver.data() + in_count_),
                                      frames_.count());
  const bool moved = !(stage_from_driver_ == Matrix4());
  ForRanges(parallel, in_count_, kWrapGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Double3 p{inputs.driver.x[i], inputs.driver.y[i], inputs.driver.z[i]};
      driver[i] = moved ? TransformPoint(stage_from_driver_, p) : p;
    }
  });
  frames_.Run(driver, frames, parallel);
  ForRanges(parallel, point_count(), kWrapGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const float w = weights_[i] * envelope;
      if (w == 0 || offsets_[i] == offsets_[i + 1]) continue;
      const Rest& rest = rest_[i];
      const Place now = PlaceOf(i, rest.tangent, rest.binormal, driver, frames);
      const Double3 p{in.x[i], in.y[i], in.z[i]};
      Double3 goal = now.anchor;
      if (mode_ != WrapMode::kSnap) {
        const Double3 offset = p - rest.place.anchor;
        if (now.turns && rest.place.turns) {
          goal = goal + now.tangent * Dot(rest.place.tangent, offset) +
                 now.binormal * Dot(rest.place.binormal, offset) +
                 now.normal * Dot(rest.place.normal, offset);
        } else {
          goal = goal + offset;
        }
      }
      out.x[i] = static_cast<float>(p.x + (goal.x - p.x) * w);
      out.y[i] = static_cast<float>(p.y + (goal.y - p.y) * w);
      out.z[i] = static_cast<float>(p.z + (goal.z - p.z) * w);
    }
  });
}

}  // namespace kpsa
