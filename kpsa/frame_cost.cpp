#include "kpsa/frame_cost.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <utility>

#include "kpsa/cue_choice.h"
#include "kpsa/poses.h"
#include "kpsa/tile_trust.h"

namespace kpsa {
namespace {

constexpr double kDoubtCost = 100;  // ns a tile, on the scale of the nodes' costs
constexpr double kByteCost = 0.03;  // ns a byte of the tiles, likewise
constexpr double kPartial = 0.4;    // of a full evaluation: what patches cost that are worth a try
// Shares of the largest doubt that are tried (PatchLayout::share)
constexpr double kShares[] = {0.15, 0.25, 0.4, 0.6, 1};
// Of the cost with a score of all points: known to hold on clips, it stays where parts do not spare more
constexpr double kClearlyLess = 0.95;
constexpr double kRowCost = 5;  // ns a row that is measured, likewise

// Whether a patch costs clearly less than all points, as patches do on the average.
bool ArePartial(const PatchLayout& layout) {
  double sum = 0;
  for (std::size_t r = 0; r < layout.regions.size(); ++r)
    sum += layout.regions[r].level == 0 ? layout.costs[r] : 0;
  return sum < kPartial * static_cast<double>(layout.patches);
}

}  // namespace

void AskGuards(std::span<const TrainedRange> ranges, const std::vector<char>& guarded,
               const std::vector<std::vector<float>>& entries, std::size_t patches,
               std::vector<ScoreJudge>* judges) {
  for (std::size_t t = 0; t < entries.size(); ++t) {
    ScoreJudge& judge = (*judges)[t];
    for (std::size_t e = 0; e < guarded.size(); ++e) {
      const TrainedRange& range = ranges[e];
      const double asked = guarded[e] ? GuardWeight(range.lo, range.hi, range.ramp, entries[t][e]) : 0;
      if (!(asked > 0)) continue;
      if (range.patches == kAllPatches) {
        judge.guard = std::max(judge.guard, asked);
        continue;
      }
      judge.guards_of_patches.resize(patches);
      RaisePatches(range.patches, static_cast<float>(asked), judge.guards_of_patches);
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

void GivePatches(const PatchLayout& patches, Subspace* subspace) {
  if (subspace->doubt_inputs() > 0) subspace->patches = patches;
}

FrameCost ExpectedCost(const Subspace& subspace, std::span<const ScoreJudge> judges, double points,
                       double full, double tolerance, double confidence) {
  std::vector<CalibrationPair> pairs;
  for (const ScoreJudge& judge : judges)
    pairs.push_back(PairOf(judge.pose, subspace.score, subspace.patches, judge.guard, judge.kind,
                           judge.guards_of_patches));
  const Calibration found =
      Calibrate(pairs, tolerance, subspace.violation_rate, subspace.blend_start, confidence);
  FrameCost cost;
  double kinds = 0, bytes = 0;
  std::map<int, double> costs;
  for (const ScoreJudge& judge : judges)
    costs[judge.kind] += ShareOfFull(judge, subspace.score, found.threshold, subspace.patches);
  for (const Calibration::Kind& kind : found.kinds) {
    if (kind.kind == static_cast<int>(PoseKind::kBeyond)) continue;
    cost.misses += costs[kind.kind] / static_cast<double>(kind.poses);
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

namespace {

// With doubts as they are.
FrameCost ChooseScoreAndParts(Subspace* subspace, std::span<const ScoreJudge> judges, double points,
                              double full, double tolerance, double confidence) {
  const auto cost = [&](std::span<const ScoreJudge> of) {
    return ExpectedCost(*subspace, of, points, full, tolerance, confidence);
  };
  PatchLayout patches = std::exchange(subspace->patches, {});
  std::vector<ScoreJudge> whole;
  std::ranges::transform(judges, std::back_inserter(whole), WithoutPatches);
  const ScoreMix of_all = ScoreOf(*subspace, whole, full);
  subspace->score = of_all;
  FrameCost least = cost(whole);
  if (patches.tiles == 0) return least;
  // SoftCache's own score speaks of all points, and would say of no part that it misses
  const ScoreMix of_parts = of_all.measured > 0 ? DoubtAlone(whole) : of_all;
  const double bar = of_all.measured > 0 ? kClearlyLess * least.ns : least.ns;
  PatchLayout taken;
  subspace->patches = patches;
  subspace->score = of_parts;
  for (const double share : kShares) {
    subspace->patches.share = share;
    const FrameCost with = cost(judges);
    // Of equal ones, since a clip may go where no judge has been
    if (least.misses == with.misses && !ArePartial(patches)) continue;
    if (taken.tiles == 0 ? with.ns <= bar : with.ns < least.ns) least = with, taken = subspace->patches;
  }
  if (taken.tiles == 0) subspace->score = of_all;
  subspace->patches = taken;
  return least;
}

}  // namespace

ChosenMisses ChooseMisses(Subspace* subspace, std::span<const ScoreJudge> judges, double points, double full,
                          double tolerance, double confidence) {
  const PatchLayout patches = subspace->patches;
  ChosenMisses as_they_are{ChooseScoreAndParts(subspace, judges, points, full, tolerance, confidence), {}};
  ChosenMisses believed{{}, TrustInTiles(judges)};
  if (believed.trust.empty()) return as_they_are;
  const ScoreMix score = std::exchange(subspace->score, {});
  const PatchLayout taken = std::exchange(subspace->patches, patches);
  std::vector<ScoreJudge> weighed(judges.begin(), judges.end());
  WeighDoubts(believed.trust, *subspace, weighed);
  believed.cost = ChooseScoreAndParts(subspace, weighed, points, full, tolerance, confidence);
  if (believed.cost.ns < kClearlyLess * as_they_are.cost.ns) return believed;
  subspace->score = score, subspace->patches = taken;
  return as_they_are;
}

}  // namespace kpsa
