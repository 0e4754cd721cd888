// A rig as it is at rest, and how it is made: what stays the same whatever plays.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "base/status.h"
#include "host/acceleration.h"
#include "host/control_reach.h"
#include "host/cue_marks.h"
#include "host/node_outline.h"
#include "host/open_rig.h"
#include "host/watch.h"

namespace kpsa::engine {

inline constexpr std::size_t kMostReaches = 300;  // controls whose reach is measured

struct RigSurvey {
  std::vector<float> rest;               // [V, 3] metres, world space (V: host/clip_record.h); no clip plays
  std::vector<ControlReach> reaches;     // [controls], or empty where there are more than kMostReaches
  std::vector<OutlinedNode> nodes;       // for the points of the clip, whose controls vary
  std::vector<CueMark> cues;             // none without subspaces
  std::vector<AppliedSubspace> applied;  // likewise; their nodes are those of another copy of the rig
};

// rest: opens the rig with no clip. clip: of `opener`; "": the one that it chooses.
Result<RigSurvey> SurveyRig(const RigOpener& opener, const RigOpener& rest, const std::string& clip,
                            const std::optional<AccelerationChoice>& choice, const Watch& watch);

}  // namespace kpsa::engine
