// A subspace whose tiles have cues of their own (kpsa/training/tile_cues.h), judged by what its tiles doubt
// alone. Internal to training.
#pragma once

#include <optional>

#include "kpsa/subspace.h"
#include "kpsa/training/poor_points.h"
#include "kpsa/training/tile_builder.h"
#include "kpsa/training/tile_cues.h"

namespace kpsa::engine {

struct TileSubspace {
  Subspace subspace;
  CueSet cues;  // those that a tile reads, in the order of the subspace's rows
};

// What tiles measure, and of which poses: chosen once, for tiles of any budget.
struct TileChoice {
  std::vector<TileCandidates> candidates;
  TileCueOptions options;
  TileCues tiles;
  CueSet cues;
  Eigen::MatrixXd measured;  // [rows x poses]
};

// poses: centred with `mean`. candidates: by tile, of all outputs one after the other.
TileChoice ChooseTiles(const Eigen::VectorXd& mean, const PoseMatrix& poses,
                       std::vector<TileCandidates> candidates, const TileCueOptions& options);

// When tiles are worth their time: at most that share of the poses would be farther off than half the tolerance, or that
// of them than (nearly) all of it.
struct TilePromise {
  double most_of_half = 0, most_of_whole = 0;
  TileSteps steps = {};
  bool strict = false;  // also of few tiles
};
struct PromisingTiles {
  bool promising = false;
  // Where they are not: the points that are to blame (PoorPoints)
  Poor poor = {};
};
// What an earlier question found, of the same poses, candidates and options: errors of some tiles, and the choice.
struct TriedTiles {
  Eigen::MatrixXf errors;
  PointsOff off;
  bool chosen = false;
};
// The same where an eighth of many tiles says that the others are worth their time. choice: unchanged where trial has it;
// mostly not made where tiles are not promising.
PromisingTiles ChoosePromisingTiles(const Eigen::VectorXd& mean, const PoseMatrix& poses,
                                    const std::vector<TileCandidates>& candidates,
                                    const TileCueOptions& options, const TilePromise& promise,
                                    TriedTiles* trial, TileChoice* choice);

// What a tile is fitted to, by what that tile of the choice measures. poses: those of the choice, centred, in which the
// tile has the columns of `points`; options: the choice's, with the mean of these poses.
TileModel ModelOf(const TileChoice& choice, std::size_t tile, const PoseMatrix& poses,
                  const TileCandidates& points, const TileCueOptions& options);
// All of them, without their targets, as MakeTileSubspace takes them.
std::vector<TileModel> FitTiles(const TileChoice& choice, const PoseMatrix& poses);
// What all tiles of a choice are made with.
TileInputs InputsOf(const TileChoice& choice, const PoseMatrix& poses, std::size_t clip_poses);

// Leaves out the cues that no tile reads, and tells the subspace of the others.
void FinishTiles(TileSubspace* made);

// How far off a point of each tile of the choice would be in each of the same poses, were they stored exactly.
// [poses x tiles], 0 in folded poses, which say only which points are off; fits: as MakeTileSubspace has them, or empty.
Eigen::MatrixXf TileErrors(const PoseMatrix& poses, const TileChoice& choice,
                           std::span<const TileModel> fits = {}, PointsOff* off = nullptr);
// Share of the poses in which a tile is farther off, but some of them.
double ShareBeyond(const Eigen::MatrixXf& errors, double tolerance, std::span<const std::size_t> but = {});
// The same of `every` times as many tiles, as far as each is beyond in poses of its own.
double ExpectedBeyond(const Eigen::MatrixXf& errors, double tolerance, std::size_t every,
                      std::span<const std::size_t> but = {});

// How much of the budgets tile `tile` of an output has (TileModel::of_budget): less where it gives what a last step reads,
// since the frames that the step turns details with are of differences of neighbours.
double BudgetOfTile(const SubspaceOutput& output, std::size_t tile);

// The first clip_poses of the same poses are of clips. The caller fills what MakeSubspace's does. fits: by tile, without
// their targets, what the tiles were fitted to the first time, whatever is stored of it; empty: this is the first time.
TileSubspace MakeTileSubspace(const Eigen::VectorXd& mean, const PoseMatrix& poses, std::size_t clip_poses,
                              const TileChoice& choice, std::vector<SubspaceOutput> outputs,
                              const TileOptions& options, std::vector<TileModel>* fits = nullptr);

}  // namespace kpsa::engine
