#include "kpsa/frame_cost.h"

#include <algorithm>

#include "kpsa/cue_choice.h"
#include "kpsa/poses.h"

namespace kpsa {
namespace {

constexpr double kDoubtCost = 100;  // ns a tile, on the scale of the nodes' costs
constexpr double kByteCost = 0.03;  // ns a byte of the tiles, likewise
constexpr double kRowCost = 5;      // ns a row that is measured, likewise

}  // namespace

void AskGuards(std::span<const TrainedRange> ranges, const std::vector<char>& guarded,
               const std::vector<std::vector<float>>& entries, std::vector<ScoreJudge>* judges) {
  for (std::size_t t = 0; t < entries.size(); ++t) {
    double& guard = (*judges)[t].guard;
    for (std::size_t e = 0; e < guarded.size(); ++e) {
      if (guarded[e])
        guard = std::max(guard, GuardWeight(ranges[e].lo, ranges[e].hi, ranges[e].ramp, entries[t][e]));
    }
  }
}

ScoreCosts CostsOfScore(const Subspace& subspace, double full) {
  if (!(full > 0)) return {};
  const auto rows = static_cast<double>(subspace.rows());
  double tiles = 0;
  for (const TileMap& map : subspace.tiles) {
    for (const std::uint32_t count : map.data().products) tiles += count > 0 ? 1 : 0;
  }
  return {kScoreCost * rows * rows / full, kDoubtCost * tiles / full};
}

ScoreMix ScoreOf(const Subspace& subspace, std::span<const ScoreJudge> judges, double full) {
  if (subspace.soft_cache.factor.size() == 0) return DoubtAlone(judges);
  return ChooseScore(judges, subspace.tolerance, subspace.violation_rate, subspace.blend_start,
                     CostsOfScore(subspace, full));
}

FrameCost ExpectedCost(const Subspace& subspace, std::span<const ScoreJudge> judges, double points,
                       double full, double tolerance, double confidence) {
  std::vector<CalibrationPair> pairs;
  for (const ScoreJudge& judge : judges) {
    pairs.push_back({subspace.score.Of(judge.pose.measured, judge.pose.doubt), judge.pose.error, judge.guard,
                     judge.kind});
  }
  const Calibration found =
      Calibrate(pairs, tolerance, subspace.violation_rate, subspace.blend_start, confidence);
  FrameCost cost;
  double kinds = 0, bytes = 0;
  for (const Calibration::Kind& kind : found.kinds) {
    if (kind.kind == static_cast<int>(PoseKind::kBeyond)) continue;
    cost.misses += 1 - static_cast<double>(kind.hits) / static_cast<double>(kind.poses);
    cost.wrong += static_cast<double>(kind.violations) / static_cast<double>(kind.poses);
    kinds += 1;
  }
  cost.misses /= std::max(kinds, 1.0), cost.wrong /= std::max(kinds, 1.0);
  for (const TileMap& tiles : subspace.tiles) bytes += static_cast<double>(tiles.bytes());
  const ScoreCosts score = CostsOfScore(subspace, full);
  cost.ns = points + kRowCost * static_cast<double>(subspace.rows()) + kByteCost * bytes +
            ((subspace.score.measured > 0 ? score.measured : 0) +
             (subspace.score.doubt > 0 ? score.doubt : 0) + cost.lost()) *
                full;
  return cost;
}

}  // namespace kpsa
