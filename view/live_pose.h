// A state of a rig as a page asks for it: plugs that were moved, over a clip at a time.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/status.h"
#include "graph/graph.h"
#include "rig/build/rig_builder.h"

namespace kpsa::engine {

// As it is asked for.
struct PoseRequest {
  std::vector<std::pair<std::string, double>> set;  // plugs and numbers in the units of the rig's file
  std::optional<std::string> clip;                  // none: the rest pose
  double seconds = 0;
};

// A plug of one number, and the number in runtime units.
struct MovedPlug {
  PlugRef plug;
  double number = 0;
  bool control = false;  // of the rig; any other plug is set in its graph
  friend bool operator==(const MovedPlug&, const MovedPlug&) = default;
};

struct LivePose {
  std::vector<MovedPlug> moved;  // each plug once, in the order of the request
  std::optional<std::string> clip;
  double seconds = 0;
  friend bool operator==(const LivePose&, const LivePose&) = default;
};

// Looks the names up in the rig at rest. Errors, all of them: no such clip or plug (the nearest is named), what takes
// no number or not this one, what the rig itself drives, a time more than kBeyondClips from every clip.
Result<LivePose> FindPose(const Rig& rest, const PoseRequest& request);
inline constexpr double kBeyondClips = 60;  // seconds

}  // namespace kpsa::engine
