#include "nodes/kernels/wrap.h"

#include <algorithm>
#include <cmath>

#include "base/check.h"
#include "nodes/kernels/weights.h"
#include "nodes/kernels/wrap_run.h"

namespace kpsa::engine {
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
      count_(out_points.size()),
      offsets_(influences.offsets) {
  KPSA_CHECK_EQ(offsets_.size(), out_points.size() + 1);
  KPSA_CHECK(IsSortedSet(out_points, rest.count));
  KPSA_CHECK(point_weights.empty() || point_weights.size() == out_points.size());
  weights_ = PaddedWeights(point_weights, count_);
  for (std::size_t i = 0; i < count_; ++i) {
    if (offsets_[i] == offsets_[i + 1]) weights_.data()[i] = 0;
  }
  for (const double share : influences.weights) shares_.push_back(static_cast<float>(share));
  shares_.resize(shares_.size() + 3);  // they are read by fours
  const auto place_in = [](const std::vector<Index>& sorted, Index point) {
    const auto it = std::lower_bound(sorted.begin(), sorted.end(), point);
    KPSA_CHECK(it != sorted.end() && *it == point);
    return static_cast<Index>(it - sorted.begin());
  };
  if (mode_ == WrapMode::kSnap) {
    const std::vector<Index> in(in_points.begin(), in_points.end());
    for (const Index point : influences.points) entries_.push_back(4 * place_in(in, point));
    return;
  }
  std::vector<Index> points = influences.points;
  std::sort(points.begin(), points.end());
  points.erase(std::unique(points.begin(), points.end()), points.end());
  frames_ = DriverFrames(driver, driver_rest, points, in_points);
  std::vector<bool> framed;  // by influence
  for (const Index point : influences.points) {
    const Index i = place_in(points, point);
    entries_.push_back(frames_.begin(i));
    framed.push_back(frames_.exists(i));
  }

  // The rest side, by what computes the present one
  AlignedFloats driver_points(DriverFloats()), frames(frames_.Floats());
  for (std::size_t i = 0; i < in_count_; ++i) {
    for (int k = 0; k < 3; ++k)
      driver_points.data()[4 * i + static_cast<std::size_t>(k)] =
          static_cast<float>(driver_rest[in_points[i]][k]);
  }
  frames_.Run(driver_points.data(), frames.data());
  const std::size_t row = PaddedCount(count_);
  directions_ = AlignedFloats(6 * row);
  for (std::size_t i = 0; i < count_; ++i) {
    Double3 normal;
    double share = 0;
    for (Index e = offsets_[i]; e < offsets_[i + 1]; ++e) {
      if (!framed[e]) continue;
      const float* n = frames.data() + entries_[e] + 12;
      normal = normal + Double3{n[0], n[1], n[2]} * influences.weights[e];
      share += influences.weights[e];
    }
    if (!(Length(normal) > kFolded)) continue;
    normal = normal * (1 / Length(normal));
    const Double3 tangent = Across(normal), binormal = Cross(normal, tangent);
    float* to = directions_.data() + i;
    for (int k = 0; k < 3; ++k, to += row) {
      to[0] = static_cast<float>(tangent[k] / share);
      to[3 * row] = static_cast<float>(binormal[k] / share);
    }
  }
  rest_ = AlignedFloats(13 * row);
  FindWrapPlaces({offsets_.data(), entries_.data(), shares_.data(), directions_.data(), nullptr, nullptr, row,
                  1, mode_ == WrapMode::kSurface},
                 frames.data(), 0, count_, rest_.data());
}

std::size_t WrapKernel::ScratchFloats() const { return DriverFloats() + frames_.Floats(); }

void WrapKernel::Run(const Inputs& inputs, ConstPointsView in, PointsView out, std::span<float> scratch,
                     const Parallel* parallel) const noexcept {
  KPSA_CHECK_EQ(in.count, point_count());
  KPSA_CHECK_EQ(out.count, point_count());
  KPSA_CHECK_EQ(inputs.driver.count, in_count_);
  KPSA_CHECK_LE(ScratchFloats(), scratch.size());
  const float envelope = static_cast<float>(inputs.envelope);
  if (envelope == 0) return CopyPoints(in, out);
  float *driver = scratch.data(), *frames = driver + DriverFloats();
  const bool moved = !(stage_from_driver_ == Matrix4());
  ForRanges(parallel, in_count_, kWrapGrain, [&](std::size_t begin, std::size_t end) {
    if (!moved) return PackWrapDriver(inputs.driver, begin, end, driver);
    for (std::size_t i = begin; i < end; ++i) {
      const Double3 p =
          TransformPoint(stage_from_driver_, {inputs.driver.x[i], inputs.driver.y[i], inputs.driver.z[i]});
      float* to = driver + 4 * i;
      to[0] = static_cast<float>(p.x), to[1] = static_cast<float>(p.y), to[2] = static_cast<float>(p.z);
      to[3] = 0;
    }
  });
  const WrapRun run{offsets_.data(),     entries_.data(), shares_.data(),
                    directions_.data(),  rest_.data(),    weights_.data(),
                    PaddedCount(count_), envelope,        mode_ == WrapMode::kSurface};
  if (mode_ == WrapMode::kSnap) {
    ForRanges(parallel, count_, kWrapGrain,
              [&](std::size_t begin, std::size_t end) { RunSnap(run, driver, in, out, begin, end); });
    return;
  }
  frames_.Run(driver, frames, parallel);
  ForRanges(parallel, count_, kWrapGrain,
            [&](std::size_t begin, std::size_t end) { RunWrap(run, frames, in, out, begin, end); });
}

}  // namespace kpsa::engine
