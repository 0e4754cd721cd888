// The subspaces that training chooses from: with cues for all points or of each tile, stored coarsely or finely.
// Internal to training.
#pragma once

#include <limits>
#include <optional>
#include <vector>

#include "kpsa/patches.h"
#include "kpsa/training/frame_cost.h"
#include "kpsa/training/tile_candidates.h"
#include "kpsa/training/tile_subspace.h"
#include "kpsa/training/trained_ranges.h"
#include "kpsa/training/training_modes.h"

namespace kpsa::engine {

// Of new poses, and at half the tolerance: cues of each tile are tried. Where these are, they are mostly better.
inline constexpr double kManyMisses = 0.05, kManyMissesOfHalf = 0.02;
bool MissMany(const CueChoice& choice);
inline constexpr double kFewMisses = 0.01;      // likewise: finer tiles for these
inline constexpr double kTooManyMisses = 0.15;  // and cues as for half the tolerance
// Of the expected cost with coarse tiles: tiles with cues of their own are stored finely. Clips miss less than judges,
// who come to the ends of ranges; the bytes are read for sure.
inline constexpr double kFinelyLess = 0.9;

// Of the cost with cues for all points: those of tiles are taken at less. Judges do not go where clips go: with few
// tiles clips hit more often than these by cues for all points, with many by cues of tiles.
inline constexpr double kAlikeOfFew = 0.85, kAlikeOfMany = 1.4;

// Tiles with cues of their own, the judges' price, and what is told of them.
struct PricedTiles {
  TileSubspace made;
  FrameCost cost = {.misses = 1, .ns = std::numeric_limits<double>::infinity()};
  bool fine = false;
  std::vector<TrainingRecord::Tried> tried = {};  // coarse, and fine
  std::size_t best = 0;                           // of these
};

// Refers to its parts. CentrePoses has centred the poses.
struct SubspaceCandidates {
  SubspaceCandidates(TrainingSetup* of_setup, TrainingPoses* of_poses, TrainingModes* of_modes,
                     TrainingRecord* of_record)
      : setup(of_setup), poses(of_poses), modes(of_modes), record(of_record) {}

  TrainingSetup* setup;
  TrainingPoses* poses;
  TrainingModes* modes;
  TrainingRecord* record;
  double modes_seconds = 0;  // that finding modes took, or what was made without many

  TrainingCues cues = {};
  PatchLayout patches = {};  // what may miss by itself
  bool fine = false;         // tiles
  bool by_tile = false;      // its cues
  bool fewer = false;        // not those that were expected to cost least, but cheaper ones
  bool tried_tiles = false;
  // What comes out of a last step is dear to measure: cues of tiles are tried, and where these do not serve, nothing is
  // made of it
  bool dear = false;
  TileSteps steps = {};  // that some points may go through, in another training
  // Points, of the rows that are trained on (PointsBeyond): they alone are to blame that cues of tiles are not promising
  Poor poor = {};
  bool may_find_more = false;        // of these, besides those that go through a step already
  FrameCost cost = {};               // by the last calibration, but points
  TileChoice tiles = {};             // where they were tried
  RangeFinder ranges_of_tiles = {};  // of the poses that these alone were trained on
  // What was not taken, not calibrated: with cues for all points, where those of tiles were; without tiles where nobody made
  // it, or not finely
  Subspace others = {};
  // Or with cues of tiles, and whether these are stored finely
  TileSubspace others_of_tiles = {};
  bool others_finely = false;
  // What that was expected to cost, at least
  double others_ns = std::numeric_limits<double>::infinity();

  // With many tiles those with cues of their own are made first, of few modes: where few judges miss, what all points would
  // measure could hardly be so much cheaper that it would be taken, and is not looked for. None where many miss; then what
  // tiles alone were trained on is set aside. None, and `poor`, where some points alone are to blame.
  bool MayBeginWithTiles() const;
  Result<std::optional<Subspace>> OfTilesAlone();
  void LeaveTilesAlone();  // also where calibration says that they do not serve

  // The subspace with which a frame is expected to cost least, by the judges; none where some tiles are poor, or where
  // it is dear and cues of tiles do not serve.
  Result<std::optional<Subspace>> Best();

  bool IsWorthTrying(const FrameCost& of) const;
  // What a frame with cues for all points costs at least, told by some of the tiles (ns); 0: nothing can be told.
  Result<double> LeastForAllPoints() const;
  // The points that these steps should be of, where cues of tiles were chosen: those that poses take far from the tolerance.
  Poor PoorOf(const TileSteps& of) const;
  double alike() const;         // at how much more cues of tiles are taken
  bool by_tiles_alone() const;  // the rig has some points before a last step
  // Nobody knows what all points would measure.
  bool knows_tiles_only() const { return by_tiles_alone() || began_with_tiles_; }
  // The largest step, and one that can be done without.
  bool HasTimeForTiles();
  Subspace ForAllPoints(bool finely);
  // With more poses, which regressions on few cues are glad of. Whether they may hit often enough.
  Result<bool> ChooseTiles();
  TileSubspace OfTiles(bool finely);
  // What does not depend on how its cues were found.
  void Describe(Subspace* subspace) const;

 private:
  // The subspace is given its best score by the judges, and is then priced.
  Result<FrameCost> Price(Subspace* subspace, const CueSet& of) const;
  std::size_t TileCount() const;
  bool HasManyTiles() const { return TileCount() >= setup->options.many_tiles; }
  // False: with nothing.
  Result<bool> CompareWithTiles(Subspace* subspace);
  // With what was cheaper but for its misses, by the judges that compare subspaces.
  Status CompareWithCheaper(Subspace* subspace);
  TrainingRecord::Tried Priced(const char* what, const CueSet& of, double misses, double ns) const;
  void Tried(const char* what, const CueSet& of, double misses, double ns);
  Status AddPosesForTiles();
  Status FindCandidatesOfTiles();
  Poor FindMorePoor();
  Result<PricedTiles> PriceTiles();
  void FindPoor(const FrameCost& of_tiles);  // where many miss

  std::vector<TileCandidates> tile_candidates_ = {}, learning_tiles_ = {};
  std::size_t modes_poses_ = 0;                // of the poses, those that modes are found of
  std::size_t folded_begin_ = 0, folded_ = 0;  // likewise, those that are folded
  std::optional<PoseMatrix> tile_poses_;       // the others, where they were set aside
  TriedTiles trial_ = {};
  std::optional<PricedTiles> priced_tiles_;
  bool began_with_tiles_ = false;
  std::vector<TileModel> fits_ = {};  // of `tiles`
  bool for_all_finely_ = false;       // how tiles with cues for all points are stored
  double best_ns_ = 0;                // of what Best has taken so far; 0: not priced
};

}  // namespace kpsa::engine
