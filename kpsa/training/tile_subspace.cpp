#include "kpsa/training/tile_subspace.h"

#include <algorithm>
#include <functional>
#include <map>
#include <numeric>
#include <utility>

#include "base/check.h"
#include "base/parallel.h"
#include "kpsa/training/cue_values.h"
#include "kpsa/training/gemm.h"
#include "kpsa/training/make_subspace.h"
#include "kpsa/training/point_errors.h"
#include "kpsa/training/tile_builder.h"

namespace kpsa::engine {
namespace {

// Of the tolerance: a point that is farther off in one pose goes through a last step, if it can; clips come back to their
// poses, and go on from there, so less is admitted in them
constexpr double kPoor = 0.5, kOfClips = 0.5, kPoorStrictly = 0.3;
constexpr double kPoorFolded = 0.5,
                 kTurned = 1;           // likewise in folded poses; and where these turn a crease over
constexpr double kBeforeStep = 0.4;     // of the budgets of a tile that gives what a last step reads
constexpr std::size_t kTrialTiles = 8;  // of so many, one is tried
constexpr double kOfWhole = 0.9;        // of the tolerance: what bytes and doubts leave of it
// Of the poses, that any tile is expected to leave beyond half the tolerance: with more, doubts tell too few apart
constexpr double kMostBeyondHalf = 0.25;
// One of about so many tiles may be poor, where the others leave so much less: what it misses is priced
constexpr std::size_t kMayBePoor = 16;
constexpr double kOfOthers = 0.5;
// All tiles, in the order of how many poses they leave farther off.
std::vector<std::size_t> WorstFirst(const Eigen::MatrixXf& errors, double tolerance) {
  std::vector<std::size_t> order(static_cast<std::size_t>(errors.cols()));
  std::iota(order.begin(), order.end(), std::size_t{0});
  const Eigen::VectorXi beyond =
      (errors.array() > static_cast<float>(tolerance)).cast<int>().colwise().sum().transpose();
  std::ranges::stable_sort(order, std::greater<>(),
                           [&](std::size_t t) { return beyond[static_cast<Eigen::Index>(t)]; });
  return order;
}

// The cues of some rows of a set.
CueSet Subset(const CueSet& set, const std::vector<std::size_t>& kept) {
  CueSet subset;
  std::vector<Eigen::Index> rows;
  subset.offsets.push_back(0);
  for (const std::size_t k : kept) {
    subset.cues.push_back(set.cues[k]);
    for (Index j = set.offsets[k]; j < set.offsets[k + 1]; ++j) rows.push_back(j);
    subset.offsets.push_back(static_cast<Index>(rows.size()));
  }
  subset.mean = set.mean(rows), subset.scale = set.scale(rows);
  return subset;
}

// Leaves out what no tile reads.
void DropUnread(TileSubspace* made) {
  std::vector<char> read(static_cast<std::size_t>(made->cues.rows()), 0);
  for (const TileMap& map : made->subspace.tiles) {
    for (const auto* columns : {&map.data().columns, &map.data().joint_rows}) {
      for (const std::uint32_t column : *columns) read[column] = 1;
    }
  }
  std::vector<std::size_t> kept;
  std::vector<std::uint32_t> now(read.size(), 0);
  std::uint32_t rows = 0;
  for (std::size_t k = 0; k < made->cues.cues.size(); ++k) {
    const Index begin = made->cues.offsets[k], end = made->cues.offsets[k + 1];
    if (std::none_of(read.begin() + begin, read.begin() + end, [](char r) { return r != 0; })) continue;
    kept.push_back(k);
    for (Index j = begin; j < end; ++j) now[j] = rows++;
  }
  for (TileMap& map : made->subspace.tiles) {
    TileData data = map.data();
    data.inputs = rows;
    for (auto* columns : {&data.columns, &data.joint_rows}) {
      for (std::uint32_t& column : *columns) column = now[column];
    }
    Result<TileMap> fewer = TileMap::Make(std::move(data), "tiles");
    KPSA_CHECK(fewer.ok());
    map = std::move(*fewer);
  }
  made->cues = Subset(made->cues, kept);
}

// A copy.
TileModel WithoutTarget(TileModel* model) {
  Eigen::MatrixXd target = std::exchange(model->target, {});
  TileModel copy = *model;
  model->target = std::move(target);
  return copy;
}

// The same the other way round.
TileModel WithTarget(TileModel model, const PoseMatrix& poses, const TileChoice& choice, std::size_t tile) {
  SetTarget(poses, choice.options, choice.candidates[tile], choice.tiles.joint[tile], &model);
  return model;
}

// The rows that a tile reads.
std::vector<std::uint32_t> ColumnsOf(const TileChoice& choice, std::size_t tile) {
  const CueSet& cues = choice.cues;
  std::vector<std::uint32_t> columns;
  for (const std::uint32_t cue : choice.tiles.of_tile[tile]) {
    for (Index j = cues.offsets[cue]; j < cues.offsets[cue + 1]; ++j) columns.push_back(j);
  }
  return columns;
}

}  // namespace

TileChoice ChooseTiles(const Eigen::VectorXd& mean, const PoseMatrix& poses,
                       std::vector<TileCandidates> candidates, const TileCueOptions& options) {
  TileChoice choice;
  choice.candidates = std::move(candidates);
  choice.options = options;
  choice.tiles = ChooseTileCues(poses, choice.candidates, options);
  choice.cues = MeasureCues(poses, mean, choice.tiles.cues, &choice.measured);
  return choice;
}

TileModel ModelOf(const TileChoice& choice, std::size_t tile, const PoseMatrix& poses,
                  const TileCandidates& points, const TileCueOptions& options) {
  const Index joint = choice.tiles.joint[tile];
  TileModel fitted =
      FitTile(poses, choice.measured, choice.cues, options, points, joint, ColumnsOf(choice, tile));
  const CueSet& cues = choice.cues;
  for (Index e = 0; e < 12 && joint != kNoIndex; ++e) {
    const auto entry = std::ranges::find(cues.cues, CueRef{CueKind::kScalar, joint + e});
    KPSA_CHECK(entry != cues.cues.end());
    fitted.joint_rows.push_back(cues.offsets[static_cast<std::size_t>(entry - cues.cues.begin())]);
  }
  if (joint != kNoIndex) fitted.joint_scale = JointScale(poses, options.mean, joint);
  return fitted;
}

std::vector<TileModel> FitTiles(const TileChoice& choice, const PoseMatrix& poses) {
  std::vector<TileModel> fits(choice.candidates.size());
  ParallelFor(fits.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      fits[t] = ModelOf(choice, t, poses, choice.candidates[t], choice.options);
      fits[t].target = {};
    }
  });
  return fits;
}

TileInputs InputsOf(const TileChoice& choice, const PoseMatrix& poses, std::size_t clip_poses) {
  TileInputs inputs;
  inputs.samples = SampledColumns(choice.measured);
  inputs.poses = &poses, inputs.measured = &choice.measured, inputs.clip_poses = clip_poses;
  inputs.row_mean = choice.cues.mean, inputs.row_scale = choice.cues.scale;
  return inputs;
}

void FinishTiles(TileSubspace* made) {
  DropUnread(made);
  Subspace& s = made->subspace;
  s.cue_mean.assign(made->cues.mean.data(), made->cues.mean.data() + made->cues.mean.size());
  s.cue_scale.assign(made->cues.scale.data(), made->cues.scale.data() + made->cues.scale.size());
  s.soft_cache.offsets = made->cues.offsets;
}

Eigen::MatrixXf TileErrors(const PoseMatrix& poses, const TileChoice& choice, std::span<const TileModel> fits,
                           PointsOff* points_off) {
  const auto count = static_cast<Eigen::Index>(poses.poses());
  const double tolerance = choice.options.tolerance;
  const PoseRanges& ranges = choice.options.ranges;
  if (points_off != nullptr) {
    const auto beyond = [&](double bound) {
      return PointsBeyond(
          poses.poses(), choice.candidates.size(), ranges,
          {bound * tolerance, kOfClips * bound * tolerance, kPoorFolded * tolerance, kTurned * tolerance});
    };
    points_off->strict = beyond(kPoorStrictly), points_off->plain = beyond(kPoor);
  }
  Eigen::MatrixXf errors(count, static_cast<Eigen::Index>(choice.candidates.size()));
  ParallelFor(choice.candidates.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      const TileModel fitted =
          fits.empty() ? FitTile(poses, choice.measured, choice.cues, choice.options, choice.candidates[t],
                                 choice.tiles.joint[t], ColumnsOf(choice, t))
                       : WithTarget(fits[t], poses, choice, t);
      const Eigen::MatrixXd measured = choice.measured(fitted.columns, Eigen::all),
                            told =
                                MultiplyFloats(GemmOperand::Dense(fitted.gain), GemmOperand::Dense(measured));
      const Eigen::MatrixXd off = PointErrors(fitted.target - told);
      errors.col(static_cast<Eigen::Index>(t)) = off.colwise().maxCoeff().cast<float>();
      errors.col(static_cast<Eigen::Index>(t))
          .segment(static_cast<Eigen::Index>(ranges.folded_begin),
                   static_cast<Eigen::Index>(ranges.folded_end - ranges.folded_begin))
          .setZero();
      if (points_off != nullptr) points_off->strict.Set(t, off), points_off->plain.Set(t, off);
    }
  });
  return errors;
}

double ShareBeyond(const Eigen::MatrixXf& errors, double tolerance, std::span<const std::size_t> but) {
  Eigen::VectorXf largest = Eigen::VectorXf::Zero(errors.rows());
  for (Eigen::Index t = 0; t < errors.cols(); ++t) {
    if (std::ranges::find(but, static_cast<std::size_t>(t)) == but.end())
      largest = largest.cwiseMax(errors.col(t));
  }
  const auto beyond = (largest.array() > static_cast<float>(tolerance)).count();
  return static_cast<double>(beyond) / static_cast<double>(std::max<Eigen::Index>(errors.rows(), 1));
}

double ExpectedBeyond(const Eigen::MatrixXf& errors, double tolerance, std::size_t every,
                      std::span<const std::size_t> but) {
  Eigen::Index beyond = (errors.array() > static_cast<float>(tolerance)).count();
  for (const std::size_t t : but)
    beyond -= (errors.col(static_cast<Eigen::Index>(t)).array() > static_cast<float>(tolerance)).count();
  return static_cast<double>(every) * static_cast<double>(beyond) /
         static_cast<double>(std::max<Eigen::Index>(errors.rows(), 1));
}

PromisingTiles ChoosePromisingTiles(const Eigen::VectorXd& mean, const PoseMatrix& poses,
                                    const std::vector<TileCandidates>& candidates,
                                    const TileCueOptions& options, const TilePromise& promise,
                                    TriedTiles* trial, TileChoice* choice) {
  const double half = options.tolerance / 2;
  const auto keeps = [&](const Eigen::MatrixXf& errors, std::span<const std::size_t> but = {}) {
    return ShareBeyond(errors, half, but) <= promise.most_of_half ||
           ShareBeyond(errors, kOfWhole * options.tolerance, but) <= promise.most_of_whole;
  };
  const bool many = candidates.size() > kTrialTiles * kTrialTiles;
  // Of few tiles none was tried, so that they are; of many some were, and but for poor ones they may be promising
  bool promising = !many && !promise.strict && promise.steps.ns.empty(), but_poor = !many && !promise.strict;
  if (many) {
    if (trial->errors.size() == 0) {
      std::vector<TileCandidates> some;
      for (std::size_t t = 0; t < candidates.size(); t += kTrialTiles) some.push_back(candidates[t]);
      trial->errors = TileErrors(poses, ChooseTiles(mean, poses, std::move(some), options), {}, &trial->off);
    }
    const Eigen::MatrixXf& errors = trial->errors;
    promising = keeps(errors) && ExpectedBeyond(errors, half, kTrialTiles) <= kMostBeyondHalf;
    if (!promising && !promise.strict) {
      std::vector<std::size_t> worst = WorstFirst(errors, half);
      worst.resize((worst.size() + kMayBePoor / 2) / kMayBePoor);
      but_poor = keeps(errors, worst) &&
                 ExpectedBeyond(errors, half, kTrialTiles, worst) <= kOfOthers * kMostBeyondHalf;
    }
    if (!promising && PoorPoints(trial->off, promise.steps, kTrialTiles).empty()) {
      if (!but_poor) return {};
      promising = true;
    }
  }
  if (!trial->chosen) *choice = ChooseTiles(mean, poses, candidates, options);
  trial->chosen = true;
  if (promising) return {true, {}};
  PointsOff off;
  const Eigen::MatrixXf errors = TileErrors(poses, *choice, {}, &off);
  if (!many && keeps(errors)) return {true, {}};
  PromisingTiles found{false, PoorPoints(off, promise.steps)};
  found.promising = but_poor && found.poor.empty();
  return found;
}

double BudgetOfTile(const SubspaceOutput& output, std::size_t tile) {
  return output.HoldsInner(tile) ? kBeforeStep : 1;
}

TileSubspace MakeTileSubspace(const Eigen::VectorXd& mean, const PoseMatrix& poses, std::size_t clip_poses,
                              const TileChoice& choice, std::vector<SubspaceOutput> outputs,
                              const TileOptions& options, std::vector<TileModel>* fits) {
  TileSubspace made;
  Subspace& s = made.subspace;
  s.outputs = std::move(outputs);
  s.components = poses.layout().components;
  made.cues = choice.cues;

  TileInputs inputs = InputsOf(choice, poses, clip_poses);
  const bool fitted = fits != nullptr && !fits->empty();
  if (fits != nullptr) fits->resize(choice.candidates.size());
  std::size_t tile = 0, first = 0;
  for (const SubspaceOutput& output : s.outputs) {
    const auto fit = [&](std::size_t k) {
      if (fitted) return WithTarget((*fits)[k], poses, choice, k);
      TileModel made_now = ModelOf(choice, k, poses, choice.candidates[k], choice.options);
      if (fits != nullptr) (*fits)[k] = WithoutTarget(&made_now);
      return made_now;
    };
    const auto model = [&](std::size_t t) {
      TileModel made_now = fit(tile + t);
      made_now.of_budget = BudgetOfTile(output, t);
      return made_now;
    };
    const std::size_t height = output.reconstructed() * static_cast<std::size_t>(s.components);
    inputs.first_column = first;
    s.tiles.push_back(
        BuildTiles(model, mean.segment(static_cast<Eigen::Index>(first), static_cast<Eigen::Index>(height)),
                   s.components, static_cast<std::size_t>(choice.cues.rows()), inputs, options));
    tile += s.tiles.back().tiles();
    first += height;
  }
  KPSA_CHECK_EQ(tile, choice.candidates.size());
  s.score = {0, 1};
  FinishTiles(&made);
  return made;
}

}  // namespace kpsa::engine
