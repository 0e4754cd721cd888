// A rig that belongs to whoever loaded it, and how it is loaded again: what measures a rig rewrites its graph,
// lets other clips play, and so wants one of its own.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/status.h"
#include "graph/node_registry.h"
#include "rig/build/rig_builder.h"

namespace kpsa::engine {

// The registry and the rig that refers to it.
struct OpenRig {
  NodeRegistry registry;
  Rig rig;
  std::optional<double> pose_time;  // seconds, where a pose file says when in its clip it is
};

// What is other than the opener says.
struct RigChange {
  std::optional<std::string> clip = {};     // that plays
  std::optional<std::string> variant = {};  // of the rig
};

// Both may be called as often as one likes, by one thread at a time.
struct RigOpener {
  std::string path;  // of the rig's file, for messages
  // Errors: those of the rig's files, and of what the change names.
  std::function<Result<std::unique_ptr<OpenRig>>(const RigChange&)> open;
  // When the rig is looked at, in seconds: at the frames of the clip that plays, or at what was asked for.
  std::function<Result<std::vector<double>>(const OpenRig&)> times;
};

}  // namespace kpsa::engine
