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

PointsBeyond::PointsBeyond(std::size_t poses, std::size_t tiles, const PoseRanges& ranges,
                           const PoseBounds& bounds)
    : poses_(poses),
      words_((poses + kWordBits - 1) / kWordBits),
      ranges_(ranges),
      bounds_(bounds),
      sizes_(tiles),
      bits_(tiles * kTilePoints * words_),
      turned_(tiles * kTilePoints) {}

void PointsBeyond::Set(std::size_t tile, const Eigen::MatrixXd& errors) {
  KPSA_CHECK_EQ(static_cast<std::size_t>(errors.cols()), poses_);
  KPSA_CHECK_LE(static_cast<std::size_t>(errors.rows()), kTilePoints);
  sizes_[tile] = static_cast<std::size_t>(errors.rows());
  for (std::size_t t = 0; t < poses_; ++t) {
    const bool folded = ranges_.IsFolded(t);
    const double bound = t < ranges_.clips ? bounds_.clips : folded ? bounds_.folded : bounds_.drawn;
    for (std::size_t k = 0; k < sizes_[tile]; ++k) {
      const double error = errors(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(t));
      if (!(error > bound)) continue;
      const std::size_t point = tile * kTilePoints + k;
      bits_[point * words_ + t / kWordBits] |= std::uint64_t{1} << t % kWordBits;
      if (folded && error > bounds_.turned) turned_[point] = 1;
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

std::vector<std::size_t> PointsBeyond::Turned() const {
  std::vector<std::size_t> turned;
  for (std::size_t p = 0; p < turned_.size(); ++p) {
    if (turned_[p]) turned.push_back(p);
  }
  return turned;
}

PointsBeyond PointsBeyond::WithoutFolded() const {
  PointsBeyond others = *this;
  std::ranges::fill(others.turned_, 0);
  for (std::size_t t = ranges_.folded_begin; t < ranges_.folded_end; ++t) {
    for (std::size_t p = 0; p < sizes_.size() * kTilePoints; ++p)
      others.bits_[p * words_ + t / kWordBits] &= ~(std::uint64_t{1} << t % kWordBits);
  }
  return others;
}

Poor PoorPoints(const PointsBeyond& beyond, const TileSteps& steps, std::size_t every) {
  if (steps.ns.empty()) return {};
  Poor poor{beyond.Worst(0), beyond.Turned()};
  bool all_step = true;
  double ns = 0;
  for (const std::size_t p : poor.points) {
    const double of_tile = steps.ns[p / kTilePoints * every];
    all_step = all_step && of_tile > 0;
    ns += of_tile / kTilePoints * static_cast<double>(every);
  }
  if (static_cast<double>(poor.points.size()) > steps.most_points * static_cast<double>(beyond.points()) ||
      !all_step || ns > (every > 1 ? kOfMost : 1) * steps.most)
    return {};
  return poor;
}

Poor PoorPoints(const PointsOff& off, const TileSteps& steps, std::size_t every) {
  for (const bool folded : {true, false}) {
    for (const PointsBeyond* beyond : {&off.strict, &off.plain}) {
      Poor poor = PoorPoints(folded ? *beyond : beyond->WithoutFolded(), steps, every);
      if (!poor.empty()) return poor;
    }
  }
  return {};
}

}  // namespace kpsa::engine
