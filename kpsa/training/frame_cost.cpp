#include "kpsa/training/frame_cost.h"

#include <algorithm>
#include <iterator>
#include <limits>
#include <map>
#include <utility>

#include "kpsa/training/cue_choice.h"
#include "kpsa/training/poses.h"
#include "kpsa/training/random.h"
#include "kpsa/training/tile_trust.h"

namespace kpsa::engine {
namespace {

constexpr double kDoubtCost = 40;    // ns a tile, on the scale of the nodes' costs
constexpr double kByteCost = 0.015;  // ns a byte of the tiles, likewise
constexpr double kPartial = 0.4;     // of a full evaluation: what patches cost that are worth a try
// Shares of the largest doubt that are tried (PatchLayout::share)
constexpr double kShares[] = {0.15, 0.25, 0.4, 0.6, 1};
// Of the cost with a score of all points: known to hold on clips, it stays where parts do not spare more
constexpr double kClearlyLess = 0.95;
constexpr double kNoWorse = 1.01;         // of the cost of misses of all points: it is none the worse
constexpr double kFewWholeMisses = 0.02;  // of the judges, by SoftCache's own score: parts are not tried
constexpr double kOutsideClips = 0.03;    // of a clip's frames, on the average of generated characters
constexpr double kRowCost = 4;            // ns a row that is measured, likewise
// Sets of as many judges, drawn of them anew: where a few poses decide, others would decide otherwise
constexpr int kDraws = 8;
constexpr std::uint64_t kDrawSeed = 0x9b05688c2b3e6c1full;

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

double CostOfReading(std::size_t rows, double bytes) {
  return kRowCost * static_cast<double>(rows) + kByteCost * bytes;
}

ScoreMix ScoreOf(const Subspace& subspace, std::span<const ScoreJudge> judges, double full) {
  if (subspace.soft_cache.factor.size() == 0) return DoubtAlone(judges);
  return ChooseScore(judges, subspace.tolerance, subspace.violation_rate, subspace.blend_start,
                     CostsOfScore(subspace, full));
}

void GivePatches(const PatchLayout& patches, Subspace* subspace) {
  if (subspace->doubt_inputs() > 0) subspace->patches = patches;
}

std::vector<CalibrationPair> PairsOf(const Subspace& subspace, std::span<const ScoreJudge> judges) {
  std::vector<CalibrationPair> pairs;
  for (const ScoreJudge& judge : judges)
    pairs.push_back(PairOf(judge.pose, subspace.score, subspace.patches, judge.guard, judge.kind,
                           judge.guards_of_patches));
  return pairs;
}

bool IsWrong(const CalibrationPair& pair, const SoftCacheThreshold& threshold, double tolerance) {
  return EmittedError(pair, threshold) > tolerance * (1 + 1e-9);
}

FrameCost ExpectedCost(const Subspace& subspace, std::span<const ScoreJudge> judges, double points,
                       double full, double tolerance, double confidence) {
  const std::vector<CalibrationPair> pairs = PairsOf(subspace, judges);
  std::map<int, std::vector<std::size_t>> kinds;
  for (std::size_t j = 0; j < judges.size(); ++j) kinds[judges[j].kind].push_back(j);
  FrameCost cost;
  Random random(kDrawSeed);
  std::vector<CalibrationPair> drawn = pairs;
  double bytes = 0;
  for (int draw = 0; draw <= kDraws; ++draw) {  // first as they are
    if (draw > 0) {
      drawn.clear();
      for (const auto& [kind, of_kind] : kinds) {
        for (std::size_t k = 0; k < of_kind.size(); ++k)
          drawn.push_back(pairs[of_kind[random.Below(of_kind.size())]]);
      }
    }
    const SoftCacheThreshold threshold =
        Calibrate(drawn, tolerance, subspace.violation_rate, subspace.blend_start, confidence).threshold;
    for (const auto& [kind, of_kind] : kinds) {
      if (kind == static_cast<int>(PoseKind::kBeyond)) continue;
      double misses = 0, wrong = 0;
      for (const std::size_t j : of_kind) {
        misses += ShareOfFull(judges[j], subspace.score, threshold, subspace.patches);
        wrong += IsWrong(pairs[j], threshold, tolerance) ? 1 : 0;
      }
      cost.misses += misses / static_cast<double>(of_kind.size());
      cost.wrong += wrong / static_cast<double>(of_kind.size());
    }
  }
  const auto counted = static_cast<double>(kinds.size() - kinds.count(static_cast<int>(PoseKind::kBeyond)));
  const double all = std::max(counted, 1.0) * (kDraws + 1);
  cost.misses /= all, cost.wrong /= all;
  for (const TileMap& tiles : subspace.tiles) bytes += static_cast<double>(tiles.bytes());
  const ScoreCosts score = CostsOfScore(subspace, full);
  cost.ns = points + CostOfReading(subspace.rows(), bytes) +
            ((subspace.score.measured > 0 ? score.measured : 0) +
             (subspace.score.doubt > 0 ? score.doubt : 0) + cost.lost()) *
                full;
  return cost;
}

std::optional<double> LostOfClips(const Subspace& subspace, std::span<const ScoreJudge> judges,
                                  const SoftCacheThreshold& threshold) {
  double lost = 0;
  std::size_t poses = 0;
  for (std::size_t j = 0; j < judges.size(); ++j) {
    if (!subspace.calibration[j].near_clips) continue;
    lost += ShareOfFull(judges[j], subspace.score, threshold, subspace.patches);
    ++poses;
  }
  return poses == 0 ? std::nullopt : std::optional(lost / static_cast<double>(poses));
}

double CostOutside(const Subspace& subspace, std::span<const ScoreJudge> judges,
                   std::span<const ScoreJudge> outside, double full, double tolerance, double confidence) {
  if (outside.empty()) return 0;
  const SoftCacheThreshold threshold = Calibrate(PairsOf(subspace, judges), tolerance,
                                                 subspace.violation_rate, subspace.blend_start, confidence)
                                           .threshold;
  const std::vector<CalibrationPair> pairs = PairsOf(subspace, outside);
  FrameCost cost;
  for (std::size_t j = 0; j < outside.size(); ++j) {
    cost.misses += ShareOfFull(outside[j], subspace.score, threshold, subspace.patches);
    cost.wrong += IsWrong(pairs[j], threshold, tolerance) ? 1 : 0;
  }
  return kOutsideClips * full * cost.lost() / static_cast<double>(outside.size());
}

namespace {

// With doubts as they are.
FrameCost ChooseScoreAndParts(Subspace* subspace, std::span<const ScoreJudge> judges, double points,
                              double full, double tolerance, double confidence,
                              std::span<const ScoreJudge> outside, ChosenMisses* chosen) {
  const auto cost = [&](std::span<const ScoreJudge> of) {
    FrameCost expected = ExpectedCost(*subspace, of, points, full, tolerance, confidence);
    std::vector<ScoreJudge> beyond(outside.begin(), outside.end());
    JudgeBy(subspace->patches, &beyond);
    expected.outside = CostOutside(*subspace, of, beyond, full, tolerance, confidence);
    return expected;
  };
  PatchLayout patches = std::exchange(subspace->patches, {});
  std::vector<ScoreJudge> whole(judges.begin(), judges.end());
  JudgeBy({}, &whole);
  const ScoreMix of_all = ScoreOf(*subspace, whole, full);
  subspace->score = of_all;
  FrameCost least = cost(whole);
  const bool weighs = !chosen->trust.empty();
  chosen->tried.push_back({of_all, 0, false, weighs, least});
  chosen->taken = 0;
  if (patches.tiles == 0) return least;
  PatchLayout taken;
  const double whole_ns = least.with_outside(), whole_misses = least.misses;
  const auto take = [&](const FrameCost& with) { least = with, taken = subspace->patches; };
  subspace->patches = patches;
  // In blends alone, where parts are cheap: a clip goes there where no judge has been, so what costs judges no more
  // is taken
  if (of_all.doubt > 0) {
    subspace->patches.blends_only = true;
    std::vector<ScoreJudge> in_blends(judges.begin(), judges.end());
    JudgeBy(subspace->patches, &in_blends);
    const FrameCost with = cost(in_blends);
    chosen->tried.push_back({of_all, patches.tiles, true, weighs, with});
    if (ArePartial(patches) && with.with_outside() <= kNoWorse * whole_ns) take(with), chosen->taken = 1;
    subspace->patches.blends_only = false;
  }
  // SoftCache's own score speaks of all points, and would say of no part that it misses. Where it misses next
  // to nothing, parts could spare next to nothing.
  if (of_all.measured > 0 && whole_misses < kFewWholeMisses) {
    subspace->patches = taken;
    return least;
  }
  const ScoreMix of_parts = of_all.measured > 0 ? DoubtAlone(whole) : of_all;
  const double bar = of_all.measured > 0 ? kClearlyLess * whole_ns : whole_ns;
  MissRule in_parts{of_parts, patches.tiles, false, weighs, {.ns = std::numeric_limits<double>::infinity()}};
  subspace->score = of_parts;
  for (const double share : kShares) {
    subspace->patches.share = share;
    const FrameCost with = cost(judges);
    if (with.with_outside() < in_parts.cost.with_outside()) in_parts.cost = with;
    // Of equal ones, since a clip may go where no judge has been
    if (whole_misses == with.misses && !ArePartial(patches)) continue;
    if (taken.tiles == 0 ? with.with_outside() <= bar
                         : with.with_outside() < std::min(bar, least.with_outside()))
      take(with), chosen->taken = chosen->tried.size();
  }
  if (chosen->taken < chosen->tried.size()) subspace->score = of_all;
  if (chosen->taken == chosen->tried.size()) in_parts.cost = least;
  subspace->patches = taken;
  chosen->tried.push_back(in_parts);
  return least;
}

}  // namespace

void AsChosen(const ChosenMisses& chosen, const Subspace& subspace, std::vector<ScoreJudge>* judges) {
  if (!chosen.trust.empty()) WeighDoubts(chosen.trust, subspace, *judges);
  JudgeBy(subspace.patches, judges);
}

ChosenMisses ChooseMisses(Subspace* subspace, std::span<const ScoreJudge> judges, double points, double full,
                          double tolerance, double confidence, std::span<const ScoreJudge> outside) {
  const PatchLayout patches = subspace->patches;
  ChosenMisses as_they_are, believed;
  as_they_are.cost =
      ChooseScoreAndParts(subspace, judges, points, full, tolerance, confidence, outside, &as_they_are);
  believed.trust = TrustInTiles(judges);
  if (believed.trust.empty()) return as_they_are;
  const ScoreMix score = std::exchange(subspace->score, {});
  const PatchLayout taken = std::exchange(subspace->patches, patches);
  std::vector<ScoreJudge> weighed(judges.begin(), judges.end()), beyond(outside.begin(), outside.end());
  for (std::vector<ScoreJudge>* of : {&weighed, &beyond}) WeighDoubts(believed.trust, *subspace, *of);
  believed.cost =
      ChooseScoreAndParts(subspace, weighed, points, full, tolerance, confidence, beyond, &believed);
  if (believed.cost.with_outside() < kClearlyLess * as_they_are.cost.with_outside()) {
    believed.tried.insert(believed.tried.end(), as_they_are.tried.begin(), as_they_are.tried.end());
    return believed;
  }
  as_they_are.tried.insert(as_they_are.tried.end(), believed.tried.begin(), believed.tried.end());
  subspace->score = score, subspace->patches = taken;
  return as_they_are;
}

}  // namespace kpsa::engine
