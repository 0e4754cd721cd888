// A subspace whose tiles have cues of their own (kpsa/training/tile_cues.h), judged by what its tiles doubt
// alone. Internal to training.
#pragma once

#include <limits>
#include <optional>

#include "kpsa/subspace.h"
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

// Of the poses: so few of them hardly matter.
inline constexpr double kFewBeyond = 0.005;

// The last steps that tiles may go through instead.
struct TileSteps {
  std::vector<double> ns = {};  // by tile, what its step costs; 0: it has none; empty: none has
  double most = std::numeric_limits<double>::infinity();  // that all of them may cost
};

// When tiles are worth their time: at most that share of the poses would be farther off than half the tolerance, or that
// of them than (nearly) all of it.
struct TilePromise {
  double most_of_half = 0, most_of_whole = 0;
  TileSteps steps = {};
  bool strict = false;  // also of few tiles
};
struct PromisingTiles {
  bool promising = false;
  // Where they are not: the tiles that are to blame (PoorTiles)
  std::vector<std::size_t> poor = {};
};
// What an earlier question found, of the same poses, candidates and options: errors of some tiles, and the choice.
struct TriedTiles {
  Eigen::MatrixXf errors;
  bool chosen = false;
};
// The same where an eighth of many tiles says that the others are worth their time. choice: unchanged where trial has it;
// mostly not made where tiles are not promising.
PromisingTiles ChoosePromisingTiles(const Eigen::VectorXd& mean, const PoseMatrix& poses,
                                    const std::vector<TileCandidates>& candidates,
                                    const TileCueOptions& options, const TilePromise& promise,
                                    TriedTiles* trial, TileChoice* choice);

// The fewest tiles without which the others keep half the tolerance in all but a few poses; none where these are not few,
// one of them has no step, or their steps cost too much. Of the tiles of `steps`, errors has one of `every`; then they may
// cost less, since among the others there are more.
std::vector<std::size_t> PoorTiles(const Eigen::MatrixXf& errors, double tolerance, const TileSteps& steps,
                                   std::size_t every = 1);

// What a tile is fitted to, by what that tile of the choice measures. poses: those of the choice, centred, in which the
// tile has the columns of `points`; options: the choice's, with the mean of these poses.
TileModel ModelOf(const TileChoice& choice, std::size_t tile, const PoseMatrix& poses,
                  const TileCandidates& points, const TileCueOptions& options);
// What all tiles of a choice are made with.
TileInputs InputsOf(const TileChoice& choice, const PoseMatrix& poses, std::size_t clip_poses);

// Leaves out the cues that no tile reads, and tells the subspace of the others.
void FinishTiles(TileSubspace* made);

// How far off a point of each tile of the choice would be in each of the same poses, were they stored exactly.
// [poses x tiles]; fits: as MakeTileSubspace has them, or empty.
Eigen::MatrixXf TileErrors(const PoseMatrix& poses, const TileChoice& choice,
                           std::span<const TileModel> fits = {});
// Share of the poses in which a tile is farther off, but some of them.
double ShareBeyond(const Eigen::MatrixXf& errors, double tolerance, std::span<const std::size_t> but = {});
// The same of `every` times as many tiles, as far as each is beyond in poses of its own.
double ExpectedBeyond(const Eigen::MatrixXf& errors, double tolerance, std::size_t every,
                      std::span<const std::size_t> but = {});
// The fewest tiles, the worst first, but for which that is at most `most`; ascending.
std::vector<std::size_t> WorstTiles(const Eigen::MatrixXf& errors, double tolerance, double most);

// How much of the budgets tile `tile` of an output has (TileModel::of_budget): less where it gives what a last step reads,
// since the frames that the step turns details with are of differences of neighbours.
double BudgetOfTile(const SubspaceOutput& output, std::size_t tile);

// The first clip_poses of the same poses are of clips. The caller fills what MakeSubspace's does. fits: by tile, without
// their targets, what the tiles were fitted to the first time, whatever is stored of it; empty: this is the first time.
TileSubspace MakeTileSubspace(const Eigen::VectorXd& mean, const PoseMatrix& poses, std::size_t clip_poses,
                              const TileChoice& choice, std::vector<SubspaceOutput> outputs,
                              const TileOptions& options, std::vector<TileModel>* fits = nullptr);

}  // namespace kpsa::engine
