// A pose of a rig as the text of a pose file, which ReadPoseFile (rig/build/rig_builder.h) reads back to the same bits.
#pragma once

#include <optional>
#include <string>

#include "rig/build/rig_builder.h"

namespace kpsa::engine {

struct PoseTextOptions {
  std::optional<std::string>
      clip;          // that the pose is over, "" being the rest pose; unset: the file says nothing of it
  double time = 0;   // seconds, when in its clip
  bool all = false;  // every control, as it is at that time; else what is posed and differs from rest
};

// Numbers are in the units of the rig's file. What is posed: ApplySetting since the rig was loaded. Errors: a value
// that no file can hold, and, of all controls, what evaluating them says.
Result<std::string> PoseText(const Rig& rig, const PoseTextOptions& options);

}  // namespace kpsa::engine
