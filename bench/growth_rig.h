// Rigs of any size: a sheet that joints bend, with as much more as is asked for.
#pragma once

#include <cstddef>
#include <string>

#include "base/status.h"

namespace kpsa::engine::growth {

struct RigSize {
  std::size_t points = 1000;  // of the sheet, about
  std::size_t joints = 4;     // a tree; each has points of its own, and turns in the clip; at most 65,536
  std::size_t nodes = 0;      // a chain of utility nodes above the points, which a control moves
  std::size_t vertices = 0;   // of a curve that all points follow, each driven by one of the joints
  std::size_t shapes = 0;     // morph targets, each of a part of the points
  bool mush = false;          // a deltaMush at the end of the stack
  std::string train = {};     // of the rig's accelerate section: "samples: 400"; "": there is none
};

// Writes FOLDER/sheet.glb, whose clip `wave` has 49 frames, and FOLDER/rig.yaml; the path of the latter. The same bytes
// for the same size.
Result<std::string> WriteRig(const RigSize& size, const std::string& folder);

}  // namespace kpsa::engine::growth
