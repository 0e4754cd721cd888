// A frame that was no hit, as subspaces learn from it (kpsa/training/learner.h).
#pragma once

#include <compare>
#include <string>
#include <utility>
#include <vector>

namespace kpsa::engine {

struct Miss {
  std::string clip;  // "": the rest pose
  double time = 0;   // of the clip, seconds
  // What is posed over it: plugs of controls (Graph::PlugName), and what they are.
  std::vector<std::pair<std::string, double>> controls = {};
  bool posed() const { return clip.empty() || !controls.empty(); }
  friend auto operator<=>(const Miss&, const Miss&) = default;
};

}  // namespace kpsa::engine
