// Where the time of an evaluation goes, as text and as JSON.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "graph/plan_report.h"
#include "host/profile_run.h"
#include "rig/build/rig_builder.h"

namespace kpsa::engine {

// `sort`: self, inclusive, count, points or name; `top`: nodes that are listed.
std::string ProfileText(const Plan& plan, const Measured& measured, std::vector<NodeTime> nodes,
                        const CriticalPath& path, const std::string& sort, std::size_t top);
std::string ProfileJson(const Rig& rig, const Plan& plan, const Measured& measured,
                        const std::vector<NodeTime>& nodes, const CriticalPath& path, int threads);

}  // namespace kpsa::engine
