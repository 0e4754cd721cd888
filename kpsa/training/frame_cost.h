// What a frame is expected to cost with a subspace: the quantity that training minimises. Internal to
// training.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "kpsa/subspace.h"
#include "kpsa/training/score_choice.h"

namespace kpsa::engine {

// Of the tolerance: where training asks what misses, since calibration may have a few more poses beyond it.
inline constexpr double kCautious = 0.9;

// What guards ask for in each judge's pose. entries: of the signals with ranges, by pose; guarded: by entry;
// patches: how many those that do not speak of all of them may speak of.
void AskGuards(std::span<const TrainedRange> ranges, const std::vector<char>& guarded,
               const std::vector<std::vector<float>>& entries, std::size_t patches,
               std::vector<ScoreJudge>* judges);

// full: what the whole evaluation costs (ns, on the scale of the nodes' costs); 0: unknown.
ScoreCosts CostsOfScore(const Subspace& subspace, double full);
// What cues and tiles take of a frame: rows that are measured, bytes of tiles that are read (ns, on that scale).
double CostOfReading(std::size_t rows, double bytes);
// How a subspace is judged best: by what its tiles doubt alone where it has no score of its own.
ScoreMix ScoreOf(const Subspace& subspace, std::span<const ScoreJudge> judges, double full);

// Parts may miss by themselves where doubts judge alone: SoftCache's own score speaks of all points, and
// would say of no part that it misses.
void GivePatches(const PatchLayout& patches, Subspace* subspace);

// Scores and errors of poses, with the score and the patches of the subspace.
std::vector<CalibrationPair> PairsOf(const Subspace& subspace, std::span<const ScoreJudge> judges);

// Whether what is emitted of a pose is beyond the tolerance.
bool IsWrong(const CalibrationPair& pair, const SoftCacheThreshold& threshold, double tolerance);

struct FrameCost {
  double misses = 0;  // share of the judges, all kinds alike; those of patches count as what they cost
  double wrong = 0;   // likewise: accepted, and beyond the tolerance
  double ns = 0;      // of a frame; a wrong one counts as so many that miss
  // What those lose by misses, of a full evaluation, that are made as the clips are; none: there are no such judges
  std::optional<double> lost_of_clips = {};
  double near = 0;     // share of the sampled ones that are off by more than half the tolerance
  double outside = 0;  // CostOutside, which `ns` does not have
  double with_outside() const { return ns + outside; }
  double lost() const { return misses + kWrongCost * wrong; }
  static constexpr double kWrongCost = 0.5;
};
// With the score of the subspace and its rate; tolerance (scene units) and confidence: of the calibration
// with these judges, on the average of sets drawn of them (bootstrap), as calibration has others. Poses
// beyond the ranges, where guards decide, do not count. points: what the graph spends until the points among
// its cues are there (ns).
FrameCost ExpectedCost(const Subspace& subspace, std::span<const ScoreJudge> judges, double points,
                       double full, double tolerance, double confidence);
// FrameCost::lost_of_clips of a calibrated subspace, whose calibration is of these judges: what far poses miss, playback
// does not.
std::optional<double> LostOfClips(const Subspace& subspace, std::span<const ScoreJudge> judges,
                                  const SoftCacheThreshold& threshold);
// What is added to ExpectedCost by frames a little beyond the trained ranges, of which clips have a few percent: that
// guards miss them, or that they are wrong (ns). outside: such poses, of which guards have been asked.
double CostOutside(const Subspace& subspace, std::span<const ScoreJudge> judges,
                   std::span<const ScoreJudge> outside, double full, double tolerance, double confidence);
// What frames may be told to miss by, and what that is expected to cost.
struct MissRule {
  ScoreMix score;
  std::size_t tiles = 0;   // of a part that misses by itself; 0: all points miss together
  bool in_blends = false;  // parts miss by themselves in blends only
  bool weighs = false;     // the doubts of tiles, by how far they are believed
  FrameCost cost;
};
struct ChosenMisses {
  FrameCost cost;
  std::vector<double> trust;    // in the doubts of tiles; empty: as they are
  std::vector<MissRule> tried;  // the best of each sort, and
  std::size_t taken = 0;        // which of them it is
};
// Judges as that choice has them: doubts weighed, and patches only where these miss by themselves.
void AsChosen(const ChosenMisses& chosen, const Subspace& subspace, std::vector<ScoreJudge>* judges);
// ExpectedCost where its score is yet to be chosen, how far its tiles are believed, and whether its patches
// miss by themselves: all as a frame costs least, with those outside. Tiles stay as they are, the score is for those of
// WeighTiles. outside: as CostOutside has them.
ChosenMisses ChooseMisses(Subspace* subspace, std::span<const ScoreJudge> judges, double points, double full,
                          double tolerance, double confidence, std::span<const ScoreJudge> outside = {});

}  // namespace kpsa::engine
