// A graph as a drawing in the DOT language of Graphviz: a box a node, an arrow between two nodes that are
// connected.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "graph/graph.h"
#include "graph/plan.h"
#include "graph/profile.h"

namespace kpsa::engine {

struct DotOptions {
  const Profile* profile = nullptr;  // of the plan: boxes are coloured by time, red is where it goes
  std::size_t frames = 1;            // that the profile recorded
  bool all = false;               // draw the nodes that the plan leaves out, too: grey, the reason as tooltip
  std::vector<bool> hidden = {};  // by node index: boxes that are not drawn; empty: none
};

// The plan must have been made from the graph as it is. Without a profile: green boxes are evaluated always,
// yellow ones on demand only. Boxes are named n<node index>, so that any node name is fine.
std::string DrawDot(const Graph& graph, const Plan& plan, const DotOptions& options = {});

// The text as a quoted string of the DOT language, quotes included; control characters become spaces.
std::string DotQuoted(std::string_view text);

}  // namespace kpsa::engine
