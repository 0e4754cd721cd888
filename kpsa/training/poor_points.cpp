#include "kpsa/training/poor_points.h"

#include <algorithm>
#include <bit>
#include <numeric>

#include "base/check.h"
#include "kpsa/tiles.h"

namespace kpsa::engine {
namespace {

// Of what steps may cost, where some tiles stand for all: among the others are more that need one
constexpr double kOfMost = 0.7;
constexpr std::size_t kWordBits = 64;

}  // namespace

PointsBeyond::PointsBeyond(std::size_t poses, std::size_t tiles)
    : poses_(poses),
      words_((poses + kWordBits - 1) / kWordBits),
      sizes_(tiles),
      bits_(tiles * kTilePoints * words_) {}

void PointsBeyond::Set(std::size_t tile, const Eigen::MatrixXd& errors, double bound, double bound_of_clips,
                       std::size_t clip_poses) {
  KPSA_CHECK_EQ(static_cast<std::size_t>(errors.cols()), poses_);
  KPSA_CHECK_LE(static_cast<std::size_t>(errors.rows()), kTilePoints);
  sizes_[tile] = static_cast<std::size_t>(errors.rows());
  for (std::size_t t = 0; t < poses_; ++t) {
    for (std::size_t k = 0; k < sizes_[tile]; ++k) {
      if (!(errors(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(t)) >
            (t < clip_poses ? bound_of_clips : bound)))
        continue;
      bits_[(tile * kTilePoints + k) * words_ + t / kWordBits] |= std::uint64_t{1} << t % kWordBits;
    }
  }
}

std::size_t PointsBeyond::points() const {
  return std::accumulate(sizes_.begin(), sizes_.end(), std::size_t{0});
}

std::vector<std::size_t> PointsBeyond::Worst(double share) const {
  std::vector<std::size_t> counts(sizes_.size() * kTilePoints), order;
  for (std::size_t p = 0; p < counts.size(); ++p) {
    for (std::size_t w = 0; w < words_; ++w)
      counts[p] += static_cast<std::size_t>(std::popcount(bits_[p * words_ + w]));
    if (counts[p] > 0) order.push_back(p);
  }
  std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) { return counts[a] > counts[b]; });
  // From the best on, as long as these are beyond in few poses
  const double most = share * static_cast<double>(poses_);
  std::vector<std::uint64_t> any(words_);
  std::size_t poses = 0;
  while (!order.empty()) {
    for (std::size_t w = 0; w < words_; ++w) {
      const std::uint64_t more = bits_[order.back() * words_ + w] & ~any[w];
      any[w] |= more, poses += static_cast<std::size_t>(std::popcount(more));
    }
    if (static_cast<double>(poses) > most) break;
    order.pop_back();
  }
  std::ranges::sort(order);
  return order;
}

std::vector<std::size_t> PoorPoints(const PointsBeyond& beyond, const TileSteps& steps, std::size_t every) {
  if (steps.ns.empty()) return {};
  std::vector<std::size_t> worst = beyond.Worst(0);
  bool all_step = true;
  double ns = 0;
  for (const std::size_t p : worst) {
    const double of_tile = steps.ns[p / kTilePoints * every];
    all_step = all_step && of_tile > 0;
    ns += of_tile / kTilePoints * static_cast<double>(every);
  }
  if (static_cast<double>(worst.size()) > steps.most_points * static_cast<double>(beyond.points()) ||
      !all_step || ns > (every > 1 ? kOfMost : 1) * steps.most)
    worst.clear();
  return worst;
}

std::vector<std::size_t> PoorPoints(const PointsOff& off, const TileSteps& steps, std::size_t every) {
  std::vector<std::size_t> poor = PoorPoints(off.strict, steps, every);
  return poor.empty() ? PoorPoints(off.plain, steps, every) : poor;
}

}  // namespace kpsa::engine
