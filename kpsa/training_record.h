// What a subspace remembers of its training, as the JSON text in Subspace::training: counts, seeds, held-out
// errors. Nothing of it depends on the machine or the time: the same training gives
// the same bytes.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "kpsa/miss.h"
#include "kpsa/signature.h"
#include "kpsa/subspace.h"

namespace kpsa::engine {

// What is tried (TrainingRecord::Tried)
inline constexpr const char *kForAllPoints = "for all points",
                            *kFinelyStored = "for all points, tiles stored finely",
                            *kFewerCues = "fewer for all points, tiles stored finely",
                            *kForHalf = "for all points, as for half the tolerance",
                            *kByTile = "of each tile", *kByTileFinely = "of each tile, tiles stored finely";
inline constexpr const char *kBeforeLastStep = ", points before the last step",
                            *kBeforeLastStepOfSome = ", points before the last step where they are nearer",
                            *kWithHeld = ", controls that no clip moves among what is followed",
                            *kWithoutHeld = ", controls that no clip moves left at rest";

struct TrainingRecord {
  std::vector<std::string> clips;
  std::vector<std::pair<std::string, std::vector<double>>> learnt;  // clips, and the times that were learnt
  std::vector<Miss> learnt_poses;                                   // that are posed
  // What was asked for, so that the same can be asked again (TrainOptions).
  struct Asked {
    std::size_t samples = 0, calibration = 0, rows = 0, modes = 0, points = 0;
    bool by_tile = true;
  } asked;
  std::size_t clip_poses = 0, sampled_poses = 0, calibration_poses = 0;
  std::uint64_t seed = 1;
  double motion_rms = 0, diagonal = 0;        // metres
  double held_out_rms = 0, held_out_max = 0;  // of the pure reconstruction on the calibration poses, metres
                                              // (of light: its units, as all of these)
  double tile_rms = 0;                        // what tiles and half precision add
  std::string mode;                           // "map" or "paper"
  std::string warning;
  std::string limited;  // what was left out for want of time
  // Controls that the subspace does not follow, as people write their plugs: frames that move them miss.
  std::vector<std::string> at_rest = {};
  // Signals that clips move and no control does, as people write their plugs: what other clips do with them is not known.
  std::vector<std::string> by_clips_alone = {};
  // What was tried, where there was a choice: its cues, the rows that these measure, and what judges say.
  struct Tried {
    std::string what;
    std::size_t cues = 0, rows = 0;
    double misses = 0;  // share of the judges
    double cost = 0;    // of a frame, misses included, in full evaluations
    bool taken = false;
  };
  std::vector<Tried> tried;
  // Likewise how frames are told to miss (TriedRules); cost: besides that of measured points.
  struct Rule {
    std::string what;
    double misses = 0, cost = 0;
    bool taken = false;
  };
  std::vector<Rule> rules;
  // How well each part of the score alone ranks the held-out poses: areas under the ROC curve
  // (kpsa/training/separation).
  struct Separation {
    std::size_t poses = 0, beyond = 0;  // the tolerance
    double likeness = 0, doubts = 0;    // nothing where none or all are beyond
  } separation;
  // The accepted calibration pose with the largest error of what is emitted, at the trained tolerance.
  struct Worst {
    std::string kind, clip;  // PoseKindName; clip "" is the rest pose, no kind: nothing is accepted
    double time = 0;         // of the clip, seconds
    std::vector<std::pair<std::string, double>> controls;  // that are not at rest; metres, radians
    double error = 0;
  } worst;
};

std::string TrainingJson(const TrainingRecord& record);
// Missing parts come out empty; a text that is no JSON object gives an empty record.
TrainingRecord ParseTraining(const std::string& json);

// In files before version 9 the text has what the trained rig is, too: members "signature" and "controls", which are
// taken out of it. Missing parts come out empty.
TrainedRig TakeTrainedRig(std::string* json);
// The text with both of them, for people.
std::string TrainingText(const Subspace& subspace);

}  // namespace kpsa::engine
