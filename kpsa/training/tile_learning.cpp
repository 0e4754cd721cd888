#include "kpsa/training/tile_learning.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "base/parallel.h"
#include "kpsa/training/cue_values.h"
#include "kpsa/training/make_subspace.h"
#include "kpsa/training/quantile.h"
#include "kpsa/training/tile_builder.h"
#include "kpsa/training/tile_splice.h"

namespace kpsa::engine {
namespace {

constexpr double kLearntWell = 0.5;       // of the tolerance: a tile may be off there
constexpr std::size_t kDoubtPoses = 800;  // that say how much tiles doubt what they know

using CueKey = std::pair<std::pair<CueKind, Index>, Index>;
CueKey CueKeyOf(const CueRef& cue) { return {{cue.kind, cue.index}, cue.joint}; }

// As the run time measures them, before they are rounded.
void ReadCues(const CueSet& set, const PoseMatrix& poses, std::size_t pose, const Eigen::VectorXd& mean,
              double* raw) {
  CueReader reader(poses.layout(), poses.row(pose), &mean);
  for (std::size_t k = 0; k < set.cues.size(); ++k) reader.Read(set.cues[k], raw + set.offsets[k]);
}

// y of all poses. [r x T]
Eigen::MatrixXd MeasureWith(const CueSet& set, const PoseMatrix& poses, const Eigen::VectorXd& mean) {
  Eigen::MatrixXd measured(set.rows(), static_cast<Eigen::Index>(poses.poses()));
  ParallelFor(poses.poses(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t)
      ReadCues(set, poses, t, mean, measured.col(static_cast<Eigen::Index>(t)).data());
  });
  measured.colwise() -= set.mean;
  return set.scale.asDiagonal() * measured;
}

// Tiles in more spaces than there may be stay in that of the points where theirs are new.
TileCues ChooseWithin(const TileSubspace& made, const PoseMatrix& poses, std::vector<TileCandidates> tiles,
                      const TileCueOptions& options) {
  TileCues chosen = ChooseTileCues(poses, tiles, options);
  std::set<Index> known;
  for (const CueRef& cue : made.cues.cues) known.insert(cue.joint);
  std::set<Index> all(known);
  all.insert(chosen.joint.begin(), chosen.joint.end());
  all.insert(kNoIndex);
  if (all.size() <= std::min(kMaxCueJoints, kMaxTileJoints)) return chosen;
  for (std::size_t t = 0; t < tiles.size(); ++t) {
    if (!known.contains(chosen.joint[t])) tiles[t].joints.clear();
  }
  return ChooseTileCues(poses, tiles, options);
}

// Into `set`, behind what is there; where in it each of the cues is.
std::vector<std::size_t> AddToSet(const CueSet& fresh, CueSet* set) {
  std::map<CueKey, std::size_t> number;
  for (std::size_t k = 0; k < set->cues.size(); ++k) number.emplace(CueKeyOf(set->cues[k]), k);
  std::vector<std::size_t> places;
  for (std::size_t k = 0; k < fresh.cues.size(); ++k) {
    const auto [found, is_new] = number.emplace(CueKeyOf(fresh.cues[k]), set->cues.size());
    places.push_back(found->second);
    if (!is_new) continue;
    const Index first = fresh.offsets[k], rows = fresh.offsets[k + 1] - first;
    const Eigen::Index before = set->rows();
    set->cues.push_back(fresh.cues[k]);
    set->offsets.push_back(set->offsets.back() + rows);
    for (Eigen::VectorXd* list : {&set->mean, &set->scale}) list->conservativeResize(before + rows);
    set->mean.tail(rows) = fresh.mean.segment(first, rows);
    set->scale.tail(rows) = fresh.scale.segment(first, rows);
  }
  return places;
}

}  // namespace

TileTrial TryTiles(const TileSubspace& made, const Eigen::VectorXd& mean, const PoseMatrix& poses,
                   std::size_t first, std::size_t stride) {
  const Subspace& s = made.subspace;
  const std::size_t tiles = s.tile_count(),
                    count = first < poses.poses() ? (poses.poses() - first + stride - 1) / stride : 0;
  std::vector<std::vector<double>> errors(count), doubts(count);
  ParallelFor(count, 8, [&](std::size_t begin, std::size_t end) {
    SubspaceScratch scratch(s);
    std::vector<double> raw(s.rows());
    std::vector<float> of_tiles(tiles);
    std::vector<PointBuffer> buffers;
    for (const SubspaceOutput& output : s.outputs) buffers.emplace_back(output.reconstructed());
    for (std::size_t i = begin; i < end; ++i) {
      const std::size_t pose = first + i * stride;
      const std::span<const float> row = poses.row(pose);
      ReadCues(made.cues, poses, pose, mean, raw.data());
      Measure(s, raw, &scratch);
      if (scratch.t.size() > 0) LargestDoubt(s, scratch.inputs(), scratch.t.span(), of_tiles);
      doubts[i].assign(of_tiles.begin(), of_tiles.end());
      errors[i].assign(tiles, 0);
      std::size_t column = 0, tile = 0;
      for (std::size_t m = 0; m < buffers.size(); ++m) {
        s.tiles[m].Reconstruct(scratch.inputs(), buffers[m].view());
        const ConstPointsView p = std::as_const(buffers[m]).view();
        for (std::size_t k = 0; k < p.count; ++k, column += 3) {
          const auto at = [&](std::size_t axis) {
            return static_cast<double>(row[column + axis]) + mean[static_cast<Eigen::Index>(column + axis)];
          };
          const Double3 off{p.x[k] - at(0), p.y[k] - at(1), p.z[k] - at(2)};
          double& largest = errors[i][tile + k / kTilePoints];
          largest = std::max(largest, Length(off));
        }
        tile += s.tiles[m].tiles();
      }
    }
  });
  TileTrial trial{std::vector<double>(tiles, 0), std::vector<double>(tiles, 0), {}};
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t t = 0; t < tiles; ++t) {
      trial.errors[t] = std::max(trial.errors[t], errors[i][t]);
      trial.doubts[t] = std::max(trial.doubts[t], doubts[i][t]);
    }
    trial.of_poses.push_back(tiles == 0 ? 0 : *std::ranges::max_element(doubts[i]));
  }
  return trial;
}

std::vector<char> TilesToTeach(const TileTrial& trial, const TileTrial& known, double error, double doubt) {
  std::vector<char> taught;
  for (std::size_t t = 0; t < trial.errors.size(); ++t)
    taught.push_back(!(trial.errors[t] <= error && trial.doubts[t] <= std::max(doubt, known.doubts[t])));
  return taught;
}

TileSubspace TeachTiles(const TileSubspace& made, std::span<const char> taught, const PoseMatrix& poses,
                        std::span<const TileCandidates> candidates, const TileTraining& training) {
  std::vector<TileCandidates> tiles;
  std::vector<std::size_t> lesson(taught.size());  // of a tile: which of these
  for (std::size_t t = 0; t < taught.size(); ++t) {
    lesson[t] = tiles.size();
    if (taught[t] != 0) tiles.push_back(candidates[t]);
  }
  if (tiles.empty()) return made;
  const TileCues chosen = ChooseWithin(made, poses, tiles, training.cues);
  TileSubspace next = made;
  CueSet& set = next.cues;
  Eigen::MatrixXd measured;
  const std::vector<std::size_t> places =
      AddToSet(MeasureCues(poses, *training.mean, chosen.cues, &measured), &set);
  measured = MeasureWith(set, poses, *training.mean);
  const Eigen::VectorXd middle = measured.rowwise().mean();  // y is 0 at another pose than the mean of these
  const Eigen::MatrixXd centered = measured.colwise() - middle;
  std::map<Index, std::uint32_t> row_of;  // of scalars
  for (std::size_t k = 0; k < set.cues.size(); ++k) {
    if (set.cues[k].kind == CueKind::kScalar && set.cues[k].joint == kNoIndex)
      row_of.emplace(set.cues[k].index, set.offsets[k]);
  }
  TileInputs inputs;
  inputs.samples = SampledColumns(measured);
  inputs.poses = &poses, inputs.measured = &measured, inputs.clip_poses = training.clip_poses;
  inputs.row_mean = set.mean, inputs.row_scale = set.scale;

  const auto rows = static_cast<std::size_t>(set.rows());
  std::size_t first_tile = 0, first = 0;
  for (std::size_t m = 0; m < next.subspace.tiles.size(); ++m) {
    TileMap& map = next.subspace.tiles[m];
    const std::size_t height = map.points() * static_cast<std::size_t>(next.subspace.components);
    const std::span<const char> taken = taught.subspan(first_tile, map.tiles());
    const auto model = [&](std::size_t t) {
      const std::size_t tile = first_tile + t;
      TileModel fitted;
      if (taught[tile] == 0) {  // which is not looked at
        fitted.gain.setZero(static_cast<Eigen::Index>(candidates[tile].height), 0);
        return fitted;
      }
      std::vector<std::uint32_t> columns;
      for (const std::uint32_t cue : chosen.of_tile[lesson[tile]]) {
        for (Index j = set.offsets[places[cue]]; j < set.offsets[places[cue] + 1]; ++j) columns.push_back(j);
      }
      std::ranges::sort(columns);
      const Index joint = chosen.joint[lesson[tile]];
      fitted = FitTile(poses, centered, set, training.cues, candidates[tile], joint, std::move(columns));
      const Eigen::VectorXd shift = fitted.gain * middle(fitted.columns);
      fitted.mean -= shift;
      fitted.target.colwise() += shift;
      for (Index e = 0; e < 12 && joint != kNoIndex; ++e) fitted.joint_rows.push_back(row_of.at(joint + e));
      if (joint != kNoIndex) fitted.joint_scale = JointScale(poses, training.cues.mean, joint);
      fitted.of_budget = BudgetOfTile(next.subspace.outputs[m], t);
      return fitted;
    };
    TileData known = map.data();
    known.inputs = rows;
    map = *TileMap::Make(std::move(known), "tiles");
    if (std::ranges::find(taken, 1) != taken.end()) {
      inputs.first_column = first;
      const Eigen::VectorXd mean =
          training.mean->segment(static_cast<Eigen::Index>(first), static_cast<Eigen::Index>(height));
      map = SpliceTiles(
          map, BuildTiles(model, mean, next.subspace.components, rows, inputs, training.storage), taken);
    }
    first_tile += taken.size();
    first += height;
  }
  FinishTiles(&next);
  return next;
}

void TeachClips(std::span<const PoseMatrix> learnt, std::span<const TileCandidates> candidates,
                const TileTraining& training, double tolerance, PoseMatrix* poses, TileSubspace* made) {
  const std::size_t trained = poses->poses();
  std::optional<double> doubt;  // in half of the poses before
  for (const PoseMatrix& clip : learnt) {
    const std::size_t first = poses->poses();
    const TileTrial known = TryTiles(*made, *training.mean, *poses, 0, first / kDoubtPoses + 1);
    if (!doubt) doubt = Quantile(known.of_poses, 0.5);
    poses->Append(clip);
    const TileTrial trial = TryTiles(*made, *training.mean, *poses, first);
    *made = TeachTiles(*made, TilesToTeach(trial, known, kLearntWell * tolerance, *doubt), *poses, candidates,
                       training);
  }
  poses->Truncate(trained);
}

}  // namespace kpsa::engine
