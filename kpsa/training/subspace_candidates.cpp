#include "kpsa/training/subspace_candidates.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "kpsa/training/cue_description.h"
#include "kpsa/training/make_subspace.h"
#include "kpsa/training/pose_judge.h"
#include "kpsa/training/score_choice.h"
#include "kpsa/training/tile_budgets.h"
#include "kpsa/training/tile_builder.h"
#include "kpsa/training/tile_learning.h"

namespace kpsa::engine {
namespace {

constexpr double kWorthTrying = 0.45;  // of what a frame costs: what others could save
// Cues of tiles: of the poses they are trained on, that a trial leaves beyond half the tolerance, at most; and where
// so many miss by cues for all points that others can hardly be worse
constexpr double kMostBeyond = 0.03, kMostBeyondElse = 0.1, kMostMiss = 0.3;
// Or, of the poses that miss by cues for all points, that a trial leaves beyond the tolerance
constexpr double kMostBeyondOfMisses = 0.1;
constexpr double kHopelessTiles = 0.3;  // not for cues of tiles that miss so many
constexpr double kTilesInModes = 3.5;   // how long these take, in the time that modes took
constexpr double kClearly = 0.5;        // of the expected cost of the others: cues of tiles are taken
constexpr std::size_t kToldBy = 8;      // of so many tiles, one, where there are
constexpr double kDearPoints = 0.25;    // of what a frame costs: others are tried
constexpr double kCheaper = 0.95;       // likewise: fewer cues for all points are taken
// Of the poses: another training is for what so many have farther off than half the tolerance
constexpr double kManyBeyond = 0.02;
// Likewise of those that are drawn as clips are: clips are farther off than these, and few of the judges say so
constexpr double kManyNear = 0.25;
constexpr double kTurnReach = 0.03;  // of the diagonal: how far an entry of a rotation moves points, about

}  // namespace

bool MissMany(const CueChoice& choice) {
  return choice.misses > kManyMisses || choice.misses_of_stricter > kManyMissesOfHalf;
}

bool SubspaceCandidates::by_tiles_alone() const { return !setup->rig.stepped.empty(); }

bool SubspaceCandidates::HasTimeForTiles() {
  if (setup->limit.left() > kTilesInModes * modes_seconds) return true;
  setup->limit.LeaveOut("no cues of each tile");
  return false;
}

bool SubspaceCandidates::IsWorthTrying(const FrameCost& of) const {
  const double lost = std::max(of.lost(), of.lost_of_clips.value_or(0));
  return lost > kFewMisses && lost * setup->full_cost > kWorthTrying * of.ns;
}

Subspace SubspaceCandidates::ForAllPoints(bool finely) {
  const bool paper = setup->options.mode == EstimatorMode::kPaper;
  const Estimator estimator =
      paper ? LeastSquaresEstimator(modes->pca, cues.set)
            : MapEstimator(modes->pca, cues.set,
                           setup->of_light() ? EstimatorParts::kReach : EstimatorParts::kAll);
  record->warning = estimator.warning;
  const TileStorage coarse = setup->of_light() ? TileStorage::kLight : TileStorage::kForAllPoints;
  return MakeSubspace(
      modes->pca, cues.set, estimator, MeasuredPoses(setup->layout, cues.set, poses->poses), setup->Outputs(),
      TileBudget(finely ? TileStorage::kFinely : coarse, setup->options.tolerance),
      setup->of_light() || paper || setup->options.without.tile_products ? nullptr : &poses->poses,
      poses->clip_poses);
}

Result<std::optional<Subspace>> SubspaceCandidates::Best() {
  // With many tiles also where few of the judges miss: what a tile measures is all that moves it, wherever a clip goes that
  // nobody trained on, while modes of all points know the poses that they were made of
  const bool may_try =
      setup->options.may_have_cues_by_tile && poses->judges.poses() > 0 && !setup->of_light();
  for_all_finely_ = dear || setup->options.by_tile_as_before || (may_try && MissMany(cues.choice));
  if (!for_all_finely_) steps = {};  // another training is for what this one cannot do
  Subspace subspace;
  if (may_try && (for_all_finely_ || by_tiles_alone() || HasManyTiles()) && HasTimeForTiles()) {
    const Result<bool> made = CompareWithTiles(&subspace);
    if (!made.ok()) return made.status();
    if (!*made) return std::optional<Subspace>();
  } else if (dear || by_tiles_alone()) {
    return std::optional<Subspace>();
  } else {
    fine = for_all_finely_;
    subspace = ForAllPoints(fine);
  }
  if (!by_tiles_alone()) KPSA_RETURN_IF_ERROR(CompareWithCheaper(&subspace));
  Describe(&subspace);
  return std::optional(std::move(subspace));
}

void SubspaceCandidates::Describe(Subspace* described) const {
  Subspace& subspace = *described;
  if (setup->options.keep_modes) subspace.kept_modes = KeptModesOf(modes->pca);
  if (setup->options.keep_modes)
    subspace.modes = subspace.soft_cache.modes = static_cast<std::size_t>(modes->pca.mode_count());
  subspace.mode = subspace.soft_cache.mode;  // paper mode may have fallen back
  subspace.space = setup->rig.target.space_name;
  subspace.inverse_rest_stretch = setup->inverse_rest_stretch;
  subspace.extent = setup->of_light() ? 0 : modes->diagonal;
  if (setup->of_light()) subspace.units = kLightUnits;
  subspace.tolerance = setup->options.tolerance;
  subspace.violation_rate = setup->options.violation_rate;
  subspace.cues.clear();
  for (const CueRef& cue : cues.set.cues)
    subspace.cues.push_back(DescribeCue(setup->rig, *setup->recorder, setup->totals, cue));
}

bool SubspaceCandidates::MayBeginWithTiles() const {
  const TrainOptions& options = setup->options;
  return options.may_have_cues_by_tile && options.mode == EstimatorMode::kMap && !options.keep_modes &&
         !options.without.miss_costs && !setup->of_light() && !by_tiles_alone() &&
         poses->judges.poses() > 0 && HasManyTiles() && setup->limit.left() > setup->limit.elapsed();
}

Result<std::optional<Subspace>> SubspaceCandidates::OfTilesAlone() {
  if (modes->still) return std::optional<Subspace>();
  KPSA_RETURN_IF_ERROR(setup->Say("cues of tiles", 0.6));
  const Result<bool> promising = ChooseTiles();
  if (!promising.ok()) return promising.status();
  if (*promising) {
    Result<PricedTiles> priced = PriceTiles();
    if (!priced.ok()) return priced.status();
    priced_tiles_ = std::move(*priced);
    FindPoor(priced_tiles_->cost);
  }
  if (!poor.empty()) return std::optional<Subspace>();
  began_with_tiles_ = priced_tiles_ && priced_tiles_->cost.misses < kManyMisses;
  if (!began_with_tiles_) {
    LeaveTilesAlone();
    return std::optional<Subspace>();
  }
  Subspace subspace;
  const PricedTiles& taken = *priced_tiles_;  // it stays: calibration may say that they do not serve
  record->tried = taken.tried;
  record->tried[taken.best].taken = true;
  by_tile = true, fine = taken.fine, best_ns_ = taken.cost.ns;
  subspace = taken.made.subspace, cues.set = taken.made.cues;
  Describe(&subspace);
  return std::optional(std::move(subspace));
}

void SubspaceCandidates::LeaveTilesAlone() {
  began_with_tiles_ = by_tile = fine = tried_tiles = false;
  record->tried.clear();
  cues = {}, poor = {}, cost = {}, best_ns_ = 0;
  tile_poses_ = poses->poses.TakeAfter(modes_poses_);
}

Result<PricedTiles> SubspaceCandidates::PriceTiles() {
  PricedTiles priced;
  // Their doubts alone judge them; stored finely where poses miss
  for (const bool finely : {false, true}) {
    TileSubspace made = OfTiles(finely);
    if (made.subspace.doubt_inputs() == 0) break;
    const Result<FrameCost> of = Price(&made.subspace, made.cues);
    if (!of.ok()) return of.status();
    priced.tried.push_back(Priced(finely ? kByTileFinely : kByTile, made.cues, of->misses, of->ns));
    if (of->ns < (finely ? kFinelyLess : 1) * priced.cost.ns) {
      priced.cost = *of, priced.made = std::move(made), priced.fine = finely;
      priced.best = priced.tried.size() - 1;
    }
    if (!IsWorthTrying(priced.cost) || priced.cost.misses > kHopelessTiles) break;
  }
  return priced;
}

void SubspaceCandidates::FindPoor(const FrameCost& of_tiles) {
  const bool near = of_tiles.near > kManyNear;
  if (steps.ns.empty() || (of_tiles.misses <= kManyMisses && !near) || !std::isfinite(of_tiles.ns)) return;
  if (near) steps.most_points = kMostPoor;
  poor = PoorOf(steps);
}

Poor SubspaceCandidates::PoorOf(const TileSteps& of) const {
  PointsOff off;
  TileErrors(poses->poses, tiles, fits_, &off);
  return PoorPoints(off, of);
}

// Of one with cues for all points, and of those with cues of each tile, the cheaper one.
Result<bool> SubspaceCandidates::CompareWithTiles(Subspace* subspace) {
  KPSA_RETURN_IF_ERROR(setup->Say("cues of tiles", 0.8));
  const Result<bool> promising = ChooseTiles();
  if (!promising.ok()) return promising.status();
  if (!poor.empty() || (dear && !*promising)) return false;
  PricedTiles priced;
  if (*promising && priced_tiles_) {
    priced = *std::exchange(priced_tiles_, std::nullopt);
  } else if (*promising) {
    Result<PricedTiles> now = PriceTiles();
    if (!now.ok()) return now.status();
    priced = std::move(*now);
  }
  FrameCost& of_tiles = priced.cost;
  TileSubspace& with_tiles = priced.made;
  const std::size_t first = record->tried.size();
  record->tried.insert(record->tried.end(), priced.tried.begin(), priced.tried.end());
  std::size_t best = first + priced.best;
  fine = priced.fine;
  FindPoor(of_tiles);
  if (!poor.empty()) return false;
  // As chosen, without products of tiles: others with these would hardly do better, and take their time
  by_tile = by_tiles_alone() || (of_tiles.misses < kManyMisses && of_tiles.ns < kClearly * cues.choice.cost);
  if (by_tiles_alone() && !std::isfinite(of_tiles.ns)) return false;
  if (by_tiles_alone()) {
    // What all points would measure nobody has looked at
  } else if (by_tile) {
    Tried(kForAllPoints, cues.set, cues.choice.misses, cues.choice.cost);
  } else if (const Result<double> least = LeastForAllPoints(); !least.ok()) {
    return least.status();
  } else if (of_tiles.ns < alike() * *least) {
    by_tile = true, others_ns = *least;
    Tried(for_all_finely_ ? kFinelyStored : kForAllPoints, cues.set, 0, *least);
  } else {
    KPSA_RETURN_IF_ERROR(setup->Say("subspace", 0.87));
    *subspace = ForAllPoints(for_all_finely_);
    const Result<FrameCost> of_others = Price(subspace, cues.set);
    if (!of_others.ok()) return of_others.status();
    by_tile = of_tiles.ns < alike() * of_others->ns;
    Tried(for_all_finely_ ? kFinelyStored : kForAllPoints, cues.set, of_others->misses, of_others->ns);
    others_ns = by_tile ? of_others->ns : of_tiles.ns, others_finely = fine;
    if (!by_tile) {
      best = record->tried.size() - 1, fine = for_all_finely_;
      others_of_tiles = std::move(with_tiles);
    }
    if (by_tile && for_all_finely_) others = std::move(*subspace);
  }
  record->tried[best].taken = true;
  best_ns_ = record->tried[best].cost * setup->full_cost;
  if (by_tile) *subspace = std::move(with_tiles.subspace), cues.set = std::move(with_tiles.cues);
  return true;
}

double SubspaceCandidates::alike() const { return HasManyTiles() ? kAlikeOfMany : kAlikeOfFew; }

std::size_t SubspaceCandidates::TileCount() const {
  std::size_t tiles = 0;
  for (const SubspaceOutput& output : setup->Outputs())
    tiles += (output.reconstructed() + kTilePoints - 1) / kTilePoints;
  return tiles;
}

Result<double> SubspaceCandidates::LeastForAllPoints() const {
  if (!HasManyTiles()) return 0.0;
  const Result<double> points = setup->CostOfPoints(cues.set.cues);
  if (!points.ok()) return points.status();
  const double bytes = BytesOfTiles(
      modes->pca, MapEstimator(modes->pca, cues.set), MeasuredPoses(setup->layout, cues.set, poses->poses),
      setup->Outputs(),
      TileBudget(for_all_finely_ ? TileStorage::kFinely : TileStorage::kForAllPoints,
                 setup->options.tolerance),
      setup->options.without.tile_products ? nullptr : &poses->poses, poses->clip_poses, kToldBy);
  return *points + setup->CostOfSteps() + CostOfReading(static_cast<std::size_t>(cues.set.rows()), bytes);
}

Status SubspaceCandidates::CompareWithCheaper(Subspace* subspace) {
  const std::vector<CueChoice::Other> others = std::exchange(cues.choice.cheaper, {});
  if (others.empty() || poses->judges.poses() == 0 || setup->of_light()) return Status();
  const Result<double> points = setup->CostOfPoints(cues.set.cues);
  if (!points.ok()) return points.status();
  if (*points < kDearPoints * (best_ns_ > 0 ? best_ns_ : cues.choice.cost)) return Status();
  if (best_ns_ == 0) {
    const Result<FrameCost> priced = Price(subspace, cues.set);
    if (!priced.ok()) return priced.status();
    best_ns_ = priced->ns;
    Tried(fine ? kFinelyStored : kForAllPoints, cues.set, priced->misses, priced->ns);
    record->tried.back().taken = true;
  }
  for (const CueChoice::Other& other : others) {
    if (other.cost_of_hits > kCheaper * best_ns_ || setup->limit.left() < modes_seconds) continue;
    const CueSet before = std::exchange(cues.set, MakeCueSet(modes->pca, other.cues, modes->noise));
    Subspace made = ForAllPoints(true);
    const Result<FrameCost> priced = Price(&made, cues.set);
    if (!priced.ok()) return priced.status();
    Tried(kFewerCues, cues.set, priced->misses, priced->ns);
    if (priced->ns > kCheaper * best_ns_) {
      cues.set = before;
      continue;
    }
    for (TrainingRecord::Tried& one : record->tried) one.taken = false;
    record->tried.back().taken = true;
    if (by_tile) {
      others_ns = best_ns_, others_finely = fine;
      others_of_tiles = {std::move(*subspace), before};
    }
    *subspace = std::move(made), best_ns_ = priced->ns;
    by_tile = false, fine = fewer = true;
    cues.choice.cues = other.cues;
  }
  return Status();
}

TrainingRecord::Tried SubspaceCandidates::Priced(const char* what, const CueSet& of, double misses,
                                                 double ns) const {
  return {what, of.cues.size(), static_cast<std::size_t>(of.rows()), misses, ns / setup->full_cost, false};
}

void SubspaceCandidates::Tried(const char* what, const CueSet& of, double misses, double ns) {
  record->tried.push_back(Priced(what, of, misses, ns));
}

// Regressions on few cues are glad of more.
Status SubspaceCandidates::AddPosesForTiles() {
  if (tile_poses_) {
    poses->poses.Append(*std::exchange(tile_poses_, std::nullopt));
    return Status();
  }
  modes_poses_ = poses->poses.poses();
  const TrainingSampler& sampler = *setup->trained_sampler;
  const std::size_t all = sampler.MoreForTiles(), within = poses->SampledWithin(setup->limit, all);
  if (within < all) setup->limit.LeaveOut(fmt::format("{} of {} more poses for cues of tiles", within, all));
  const double share = all == 0 ? 1 : static_cast<double>(within) / static_cast<double>(all);
  PoseMatrix more(setup->layout);
  KPSA_RETURN_IF_ERROR(sampler.AddMore(poses->poses, share, &more));
  const std::size_t drawn = more.poses();
  KPSA_RETURN_IF_ERROR(sampler.AddFolded(poses->poses.poses() + drawn, share, &more));
  folded_begin_ = modes_poses_ + drawn, folded_ = more.poses() - drawn;
  record->sampled_poses += more.poses();
  ranges_of_tiles = RangeFinder(setup->layout);
  ranges_of_tiles.Widen(more);
  if (more.poses() > 0) more.Subtract(modes->pca.mean);
  poses->poses.Append(std::move(more));
  if (poses->spare) {
    poses->spare->Subtract(modes->pca.mean);
    poses->poses.Append(*std::exchange(poses->spare, std::nullopt));
  }
  return Status();
}

Status SubspaceCandidates::FindCandidatesOfTiles() {
  if (!tile_candidates_.empty()) return Status();
  TileCandidateOptions of;
  of.layout = setup->layout, of.totals = setup->totals, of.signals = setup->recorder->signals();
  of.points = setup->of_tiles, of.positions = modes->positions, of.stages = setup->recorder->candidates();
  Result<std::vector<TileCandidates>> candidates =
      FindTileCandidates(setup->rig, &setup->compiler, setup->trained_clips, of);
  if (!candidates.ok()) return candidates.status();
  tile_candidates_ = std::move(*candidates);
  std::size_t tile = 0;
  for (const SubspaceOutput& output : setup->Outputs()) {
    for (std::size_t t = 0; kTilePoints * t < output.reconstructed(); ++t)
      tile_candidates_[tile++].before_step = output.HoldsInner(t);
  }
  if (!poses->learnt.empty()) {
    Result<std::vector<TileCandidates>> learning =
        FindTileCandidates(setup->rig, &setup->compiler, setup->clips, of);
    if (!learning.ok()) return learning.status();
    learning_tiles_ = std::move(*learning);
  }
  return Status();
}

Result<bool> SubspaceCandidates::ChooseTiles() {
  KPSA_RETURN_IF_ERROR(AddPosesForTiles());
  KPSA_RETURN_IF_ERROR(FindCandidatesOfTiles());
  tried_tiles = true;
  TileCueOptions choice;
  choice.tolerance = setup->options.tolerance;
  choice.mean = &modes->mean, choice.ranges = {poses->clip_poses, folded_begin_, folded_begin_ + folded_};
  choice.turn_reach = kTurnReach * modes->diagonal;
  const auto add = [&](Index scalar) {
    const CueRef cue{CueKind::kScalar, scalar};
    if (modes->pca.row_variance[static_cast<Eigen::Index>(CueColumn(setup->layout, cue))] >
        modes->noise.scalars[scalar])
      choice.values.push_back(cue);
  };
  const std::vector<Index> first = FirstScalars(setup->recorder->signals(), setup->layout);
  for (std::size_t s = 0; s < first.size(); ++s) {
    if (!setup->recorder->signals()[s].matrix) add(first[s]);
  }
  if (by_tiles_alone()) {  // all have been tried
    tiles = kpsa::engine::ChooseTiles(modes->pca.mean, poses->poses, tile_candidates_, choice);
    if (may_find_more) poor = FindMorePoor();
    return poor.empty();
  }
  TilePromise promise{cues.choice.misses > kMostMiss ? kMostBeyondElse : kMostBeyond,
                      kMostBeyondOfMisses * cues.choice.misses, steps, dear};
  if (dear) promise.most_of_half = kFewBeyond, promise.most_of_whole = 0;
  PromisingTiles chosen =
      ChoosePromisingTiles(modes->pca.mean, poses->poses, tile_candidates_, choice, promise, &trial_, &tiles);
  poor = std::move(chosen.poor);
  return chosen.promising;
}

// Tiles with inner points are others than those that said which points need them, and so are their cues.
Poor SubspaceCandidates::FindMorePoor() {
  PointsOff off;
  fits_ = FitTiles(tiles, poses->poses);
  TileErrors(poses->poses, tiles, fits_, &off);
  const auto as_they_come_out = [&](std::vector<std::size_t> rows) {
    std::erase_if(rows, [&](std::size_t row) { return !setup->PointThatComesOut(row); });
    return rows;
  };
  if (as_they_come_out(off.plain.WithoutFolded().Worst(kManyBeyond)).empty()) return {};
  return {as_they_come_out(off.plain.Worst(0)), as_they_come_out(off.plain.Turned())};
}

TileSubspace SubspaceCandidates::OfTiles(bool finely) {
  const TileOptions storage =
      TileBudget(finely ? TileStorage::kFinely : TileStorage::kOwnCues, setup->options.tolerance);
  TileSubspace made = MakeTileSubspace(modes->pca.mean, poses->poses, poses->clip_poses, tiles,
                                       setup->Outputs(), storage, &fits_);
  TeachClips(poses->learnt, learning_tiles_, {&modes->pca.mean, poses->clip_poses, tiles.options, storage},
             setup->options.tolerance, &poses->poses, &made);
  return made;
}

Result<FrameCost> SubspaceCandidates::Price(Subspace* subspace, const CueSet& of) const {
  const Result<double> points = setup->CostOfPoints(of.cues);
  if (!points.ok()) return points.status();
  GivePatches(patches, subspace);
  std::vector<ScoreJudge> judged;
  for (const JudgedPose& pose :
       PoseJudge(setup->rig, *subspace, setup->layout, of, !setup->options.without.trust)
           .Judge(poses->judges))
    judged.push_back({pose, 0, poses->judge_kinds[judged.size()]});
  subspace->tolerance = setup->options.tolerance;
  subspace->violation_rate = setup->options.violation_rate;
  FrameCost cost = ChooseMisses(subspace, judged, *points + setup->CostOfSteps(), setup->full_cost,
                                kCautious * setup->options.tolerance, kEvenOdds)
                       .cost;
  std::size_t sampled = 0, near = 0;
  for (const ScoreJudge& judge : judged) {
    if (judge.kind != static_cast<int>(PoseKind::kSampled)) continue;
    ++sampled, near += judge.pose.error > setup->options.tolerance / 2;
  }
  cost.near = static_cast<double>(near) / static_cast<double>(std::max<std::size_t>(sampled, 1));
  return cost;
}

}  // namespace kpsa::engine
