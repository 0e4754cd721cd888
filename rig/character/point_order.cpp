#include "rig/character/point_order.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

namespace kpsa::engine {
namespace {

constexpr double kPlaces = 10;        // of the box's diagonal, in roots of weights
constexpr std::size_t kProbes = 256;  // points that tell along which direction some are cut
constexpr int kRounds = 8;            // of the power method

// Interleaves the low 21 bits of three numbers: x0 y0 z0 x1 y1 z1 ... (Morton order).
std::uint64_t Morton(std::uint64_t x, std::uint64_t y, std::uint64_t z) {
  const auto spread = [](std::uint64_t v) {
    v &= 0x1fffff;
    v = (v | v << 32) & 0x1f00000000ffffull;
    v = (v | v << 16) & 0x1f0000ff0000ffull;
    v = (v | v << 8) & 0x100f00f00f00f00full;
    v = (v | v << 4) & 0x10c30c30c30c30c3ull;
    v = (v | v << 2) & 0x1249249249249249ull;
    return v;
  };
  return spread(x) | spread(y) << 1 | spread(z) << 2;
}

class Halver {
 public:
  Halver(const gltf::Mesh& mesh, std::span<const Index> vertices) : mesh_(mesh) {
    low_.fill(std::numeric_limits<double>::infinity());
    std::array<double, 3> high;
    high.fill(-std::numeric_limits<double>::infinity());
    for (const Index v : vertices) {
      for (std::size_t i = 0; i < 3; ++i) {
        low_[i] = std::min(low_[i], Coordinate(v, i));
        high[i] = std::max(high[i], Coordinate(v, i));
      }
    }
    double squared = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const double size = high[i] - low_[i];
      squared += size * size, extent_ = std::max(extent_, size);
    }
    place_ = squared > 0 ? kPlaces / std::sqrt(squared) : 0;
    std::size_t joints = 0;
    if (mesh.skinned()) {
      for (const gltf::Influence& influence : mesh.influences)
        joints = std::max(joints, std::size_t{influence.joint} + 1);
    }
    axis_.resize(3 + joints), mean_.resize(3 + joints), next_.resize(3 + joints);
  }

  // Along a Morton curve; one scale for all axes keeps its cells cubes.
  void SortAlongCurve(std::span<Index> some) const {
    std::vector<std::pair<std::uint64_t, Index>> keys;
    keys.reserve(some.size());
    for (const Index v : some) {
      std::array<std::uint64_t, 3> cell;
      for (std::size_t i = 0; i < 3; ++i)
        cell[i] = static_cast<std::uint64_t>((Coordinate(v, i) - low_[i]) / extent_ * 0x1fffff);
      keys.emplace_back(Morton(cell[0], cell[1], cell[2]), v);
    }
    std::ranges::sort(keys);
    for (std::size_t k = 0; k < some.size(); ++k) some[k] = keys[k].second;
  }

  void Sort(std::span<Index> some) {
    if (some.size() <= kOrderTogether) return SortAlongCurve(some);
    FindAxis(some);
    keys_.clear();
    for (const Index v : some) keys_.emplace_back(Along(v, axis_), v);
    const std::size_t tiles = (some.size() + kOrderTogether - 1) / kOrderTogether;
    const std::size_t half = (tiles + 1) / 2 * kOrderTogether;
    sorted_ = keys_;
    const auto middle = sorted_.begin() + static_cast<std::ptrdiff_t>(half);
    std::nth_element(sorted_.begin(), middle, sorted_.end());
    // Both halves stay in the order of the vertices, as no library promises
    std::size_t first = 0, second = half;
    for (const auto& key : keys_) some[key < *middle ? first++ : second++] = key.second;
    Sort(some.first(half));
    Sort(some.subspan(half));
  }

 private:
  double Coordinate(Index v, std::size_t i) const { return static_cast<double>(mesh_.positions[3 * v + i]); }

  // Calls use(dimension, value) for what is not 0 of a vertex.
  template <typename Use>
  void ForEach(Index v, const Use& use) const {
    for (std::size_t i = 0; i < 3; ++i) use(i, place_ * (Coordinate(v, i) - low_[i]));
    if (!mesh_.skinned()) return;
    for (const gltf::Influence& influence : mesh_.influence_rows().row(v))
      use(3 + std::size_t{influence.joint}, std::sqrt(static_cast<double>(influence.weight)));
  }
  double Along(Index v, const std::vector<double>& axis) const {
    double sum = 0;
    ForEach(v, [&](std::size_t d, double value) { sum += value * axis[d]; });
    return sum;
  }

  // The direction in which some of the vertices differ most.
  void FindAxis(std::span<const Index> some) {
    const std::size_t count = std::min(some.size(), kProbes);
    const auto probe = [&](std::size_t k) { return some[(2 * k + 1) * some.size() / (2 * count)]; };
    std::ranges::fill(mean_, 0);
    for (std::size_t k = 0; k < count; ++k)
      ForEach(probe(k), [&](std::size_t d, double value) { mean_[d] += value / static_cast<double>(count); });
    // From the probe that is farthest off
    Index farthest = probe(0);
    double most = -1;
    for (std::size_t k = 0; k < count; ++k) {
      double squared = 0;  // but what all have alike
      ForEach(probe(k), [&](std::size_t d, double value) { squared += value * (value - 2 * mean_[d]); });
      if (k == 0 || squared > most) most = squared, farthest = probe(k);
    }
    for (std::size_t d = 0; d < mean_.size(); ++d) axis_[d] = -mean_[d];
    ForEach(farthest, [&](std::size_t d, double value) { axis_[d] += value; });
    for (int round = 0; round < kRounds; ++round) {
      double of_mean = 0, sum = 0, squared = 0;
      for (std::size_t d = 0; d < mean_.size(); ++d) of_mean += axis_[d] * mean_[d];
      std::ranges::fill(next_, 0);
      for (std::size_t k = 0; k < count; ++k) {
        const double along = Along(probe(k), axis_) - of_mean;
        sum += along;
        ForEach(probe(k), [&](std::size_t d, double value) { next_[d] += along * value; });
      }
      for (std::size_t d = 0; d < mean_.size(); ++d) {
        next_[d] -= sum * mean_[d];
        squared += next_[d] * next_[d];
      }
      if (!(squared > 0)) return;
      for (std::size_t d = 0; d < mean_.size(); ++d) axis_[d] = next_[d] / std::sqrt(squared);
    }
  }

  const gltf::Mesh& mesh_;
  std::array<double, 3> low_;
  double extent_ = 1e-300, place_ = 0;
  std::vector<double> axis_, mean_, next_;  // [3 + joints]
  std::vector<std::pair<double, Index>> keys_, sorted_;
};

}  // namespace

void SortPoints(const gltf::Mesh& mesh, std::vector<Index>* vertices) {
  std::ranges::sort(*vertices);  // probes are every so manieth
  Halver halver(mesh, *vertices);
  // Shapes are local, as the curve is, and mostly move points that one joint leads
  if (!mesh.targets.empty()) return halver.SortAlongCurve(*vertices);
  halver.Sort(*vertices);
}

}  // namespace kpsa::engine
