// What a page is told of a vertex at a pose: what `kpsa explain` says, and which controls would move it.
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "base/status.h"
#include "rig/build/rig_builder.h"
#include "view/live_rig.h"

namespace kpsa::engine {

struct VertexAnswer {
  std::vector<std::string> lines;
  // Controls, and how far they move the vertex, metres, as they go to the farther one of their ends; farthest first.
  std::vector<std::pair<std::string, double>> moved_by;
};

// A vertex of the stack of StackedVertices (report/page_rig.h), which has it. Errors: what does not evaluate there.
Result<VertexAnswer> TellOfVertex(const Rig& rest, const LatestPose& at, std::size_t vertex);
// JSON as the page reads it.
std::string VertexAnswerText(const VertexAnswer& answer);

}  // namespace kpsa::engine
