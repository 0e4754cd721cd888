// Why a node is evaluated, and for which points; or why not.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "base/types.h"
#include "graph/plan.h"
#include "graph/profile.h"
#include "rig/build/rig_builder.h"

namespace kpsa::engine {

struct NodeStory {
  // One of those that evaluate it.
  struct Step {
    std::string name, segment;
    std::uint64_t count = 0;             // evaluations
    Index points = 0, points_total = 0;  // that it computes, of all
    std::string points_text;             // the same in words
    std::string dirtied_by;              // the last time; "" where it never ran
    std::string not_evaluated;           // why it did not run; "" where it did
    std::string needed_by, mask;         // up to the request; why these points
  };
  std::string name, type;
  std::string attribute;  // what is told of a plug of it; ""
  std::string left_out;   // why the plan has no step of it; "" where it has
  std::size_t frames = 0;
  std::vector<Step> steps;
};

// After `frames` of the plan were evaluated and recorded.
NodeStory TellOfNode(const Rig& rig, const Plan& plan, const Profile& profile, NodeId node,
                     const std::string& attribute, std::size_t frames);
// "driven by squeeze.outValue", "set to 0.5", "at its default, 1", "an output".
std::string SourceOfValue(const Rig& rig, const PlugRef& plug);

}  // namespace kpsa::engine
