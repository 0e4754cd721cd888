// Controls that have a place in the picture, where they are dragged: what a rig lets one move or turn of its joints and
// transforms.
//
// A handle is one point that goes with its node. Of what is moved it is the node's own place. What is turned stays where it
// is, so there it is a point of the surface that the node takes with it: near the middle of what moves, and on none of the
// axes.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "base/status.h"
#include "graph/graph.h"
#include "rig/build/rig_builder.h"

namespace kpsa::engine {

struct Handle {
  std::string name;                   // of the node
  bool turns = false;                 // its rotate plugs, else its translate plugs
  PlugRef matrix;                     // the node's worldMatrix
  std::vector<std::size_t> controls;  // of Rig::controls, up to three
  Double3 anchor;                     // in the node's space
};

// Of the rig at rest, where no clip plays; in the order of its controls, at most kMostHandles. What something drives has
// none, nor has what turns nothing that is shown. Errors: what does not compile or evaluate at rest.
Result<std::vector<Handle>> FindHandles(const Rig& rest);
inline constexpr std::size_t kMostHandles = 300;

}  // namespace kpsa::engine
