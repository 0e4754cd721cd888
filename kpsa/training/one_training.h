// One training from start to end: of what comes out of the stack, of inner points, or of some of many points. What of
// these serves best the trainer chooses (kpsa/training/trainer.cpp). Internal to training.
#pragma once

#include <limits>
#include <optional>
#include <vector>

#include "graph/compiler.h"
#include "kpsa/subspace.h"
#include "kpsa/training/trainer.h"
#include "kpsa/training_record.h"

namespace kpsa::engine {

// Of what a training that ended is expected to cost, which knows its cues and some of its tiles: what it comes to, about
inline constexpr double kOfExpected = 1.3;

struct Trained {
  Subspace subspace;
  TrainingRecord record;
  double ns = 0;       // what a frame is expected to cost, on the scale of the nodes' costs,
  double full_ns = 0;  // and the whole evaluation
  double lost = 0;     // of the latter what poses of all kinds lose, that miss or are wrong,
  std::optional<double> lost_of_clips = {};  // and those that are made as the clips are (FrameCost)
  double wrong = 0;                          // share of these poses that are accepted and wrong
  double seconds = 0;                        // that it took
  bool ended = false;                        // as Ends allows: there is no subspace
  std::vector<std::size_t> untold = {};      // of these, that it gets wrong unnoticed (UntoldControls)
  std::vector<std::size_t> held = {};        // controls that no clip moves (HeldControls)
  // The points, by mesh, that are to blame for that, or for what clips lose: a last step should be of them alone. Empty, where
  // it ended: with its cues.
  std::vector<std::vector<Index>> poor = {};
  std::vector<std::vector<Index>> turned =
      {};  // of these, that lie in creases: what is about them needs the step, too
};

// Where a training may end without a subspace: with its cues, where these are points that come out, a frame is expected
// to cost more than `enough`, and no cues of tiles serve; or with points of meshes with steps, which are to blame for that
// (and those that go through one already).
struct Ends {
  double enough = std::numeric_limits<double>::infinity();
  const std::vector<Compiler::SplitPoints>* steps =
      nullptr;  // by mesh; null: some points go through them already
};

// mends: last steps by which points may be mended, by mesh; or none. ends: null where there is to be a subspace. Errors:
// as Train; where the rig has steps of some tiles, also that no cues of tiles serve.
Result<Trained> TrainOnce(const TrainingRig& rig, const std::vector<TrainingClip>& clips,
                          const TrainOptions& options, const std::vector<Compiler::SplitPoints>& mends = {},
                          const Ends* ends = nullptr);

}  // namespace kpsa::engine
