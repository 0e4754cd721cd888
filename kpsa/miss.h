// A frame that was no hit, as subspaces learn from it (kpsa/learner.h).
#pragma once

#include <compare>
#include <string>
#include <utility>
#include <vector>

#include "base/status.h"
#include "kpsa/poses.h"

namespace kpsa {

struct TrainingClip;
struct TrainingRig;

struct Miss {
  std::string clip;  // "": the rest pose
  double time = 0;   // of the clip, seconds
  // What is posed over it: plugs of controls (Graph::PlugName), and what they are.
  std::vector<std::pair<std::string, double>> controls = {};
  bool posed() const { return clip.empty() || !controls.empty(); }
  friend auto operator<=>(const Miss&, const Miss&) = default;
};

// Posed misses as samples of the controls: each, and what lies between it and the pose without its controls,
// which is as new. Their clips are among `clips`. Errors: a control that the rig lacks.
Result<std::vector<SampledPose>> SamplesOf(const std::vector<Miss>& misses, const TrainingRig& rig,
                                           const std::vector<TrainingClip>& clips);

}  // namespace kpsa
