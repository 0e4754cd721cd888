#include "nodes/kernels/tension.h"

#include <algorithm>
#include <cmath>

#include "base/check.h"
#include "nodes/kernels/weights.h"

namespace kpsa::engine {
namespace {

double Distance(ConstPointsView points, Index a, Index b) {
  const double x = static_cast<double>(points.x[b]) - points.x[a];
  const double y = static_cast<double>(points.y[b]) - points.y[a];
  const double z = static_cast<double>(points.z[b]) - points.z[a];
  return std::sqrt(x * x + y * y + z * z);
}

std::vector<Index> ActiveOutputs(std::size_t count, std::span<const float> point_weights) {
  std::vector<Index> active;
  for (std::size_t i = 0; i < count; ++i) {
    if (point_weights.empty() || point_weights[i] != 0) active.push_back(static_cast<Index>(i));
  }
  return active;
}

std::vector<Index> PointsAt(std::span<const Index> points, std::span<const Index> positions) {
  std::vector<Index> result;
  for (Index i : positions) result.push_back(points[i]);
  return result;
}

}  // namespace

std::vector<Index> TensionDemand(const Topology& topology, std::span<const Index> out_points,
                                 std::span<const float> point_weights) {
  // The corners of the triangles around a point are its neighbours: normals need no more
  std::vector<Index> demand =
      topology.Dilate(PointsAt(out_points, ActiveOutputs(out_points.size(), point_weights)), 1);
  demand.insert(demand.end(), out_points.begin(), out_points.end());
  std::sort(demand.begin(), demand.end());
  demand.erase(std::unique(demand.begin(), demand.end()), demand.end());
  return demand;
}

StrainKernel::StrainKernel(const Topology& topology, ConstPointsView rest, std::span<const Index> out_points,
                           std::span<const Index> in_points)
    : at_(PositionsIn(in_points, out_points)) {
  KPSA_CHECK_EQ(rest.count, topology.point_count());
  offsets_.push_back(0);
  for (Index p : out_points) {
    double length = 0;
    const std::span<const Index> ring = topology.neighbors().row(p);
    for (Index q : ring) length += Distance(rest, p, q);
    const bool measured = length > 0 && std::isfinite(length);
    rest_.push_back(measured ? length : 0);
    for (std::size_t k = 0; measured && k < ring.size(); ++k) {
      const auto place = std::lower_bound(in_points.begin(), in_points.end(), ring[k]);
      KPSA_CHECK(place != in_points.end() && *place == ring[k]);
      neighbors_.push_back(static_cast<Index>(place - in_points.begin()));
    }
    offsets_.push_back(static_cast<Index>(neighbors_.size()));
  }
}

void StrainKernel::Run(double growth, ConstPointsView in, float* strain,
                       const Parallel* parallel) const noexcept {
  ForRanges(parallel, at_.size(), 1024, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      double length = 0;
      for (Index e = offsets_[i]; e < offsets_[i + 1]; ++e) length += Distance(in, at_[i], neighbors_[e]);
      strain[i] = rest_[i] > 0 && growth > 0 ? static_cast<float>(length / (rest_[i] * growth) - 1) : 0.0f;
    }
  });
}

TensionPushKernel::TensionPushKernel(const Topology& topology, ConstPointsView rest,
                                     std::span<const Index> out_points, std::span<const Index> in_points,
                                     std::span<const float> point_weights)
    : at_(PositionsIn(in_points, out_points)), active_(ActiveOutputs(out_points.size(), point_weights)) {
  KPSA_CHECK(point_weights.empty() || point_weights.size() == out_points.size());
  const std::vector<Index> active_points = PointsAt(out_points, active_);
  for (Index i : active_) weights_.push_back(point_weights.empty() ? 1.0f : point_weights[i]);
  strain_.emplace(topology, rest, active_points, in_points);
  normals_.emplace(topology, active_points, in_points);
}

std::size_t TensionPushKernel::ScratchFloats() const {
  return 4 * PaddedCount(active_.size()) + normals_->ScratchFloats();
}

void TensionPushKernel::Run(const Inputs& inputs, ConstPointsView in, PointsView out,
                            std::span<float> scratch, const Parallel* parallel) const noexcept {
  KPSA_CHECK_EQ(out.count, at_.size());
  KPSA_CHECK_LE(ScratchFloats(), scratch.size());
  // All that is read around a point is read before any point is written
  const std::size_t row = PaddedCount(active_.size());
  float* strain = scratch.data();
  const PointsView normals{strain + row, strain + 2 * row, strain + 3 * row, active_.size()};
  const bool moves =
      !active_.empty() && inputs.envelope != 0 && !(inputs.compress_scale == 0 && inputs.stretch_scale == 0);
  if (moves) {
    strain_->Run(inputs.growth, in, strain, parallel);
    normals_->Run(in, normals, scratch.subspan(4 * row), parallel);
  }
  if (in.x != out.x) GatherPoints(in, at_, out);
  if (!moves) return;
  ForRanges(parallel, active_.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const double amount =
          strain[k] > 0 ? inputs.stretch_scale * strain[k] : -inputs.compress_scale * strain[k];
      const float push = static_cast<float>(amount * inputs.envelope * weights_[k]);
      if (push == 0) continue;
      const Index i = active_[k];
      out.x[i] += push * normals.x[k];
      out.y[i] += push * normals.y[k];
      out.z[i] += push * normals.z[k];
    }
  });
}

}  // namespace kpsa::engine
