// What a plan keeps of a rig and what it leaves out, as text and as JSON.
#pragma once

#include <string>

#include "graph/plan.h"

namespace kpsa::engine {

// `each_step`: a row a step; else the steps of a node in a segment are one.
std::string PlanText(const Plan& plan, bool each_step);
std::string PlanJson(const Plan& plan, bool each_step);

}  // namespace kpsa::engine
