// Why a step of a plan is there, ran, and has the points that it has: one line each.
#pragma once

#include <string>

#include "graph/profile.h"

namespace kpsa::engine {

std::string PointsText(const Plan::StepInfo& info);  // "20 of 17,121 points"
// From a step's last evaluation back to the plug that was set: "time.time > jaw > skin".
std::string CauseChain(const Plan& plan, const Profile& profile, Index step);
// The shortest way from a step, which is left out, to what was asked for: "mush (all 4,199 points) > the
// request".
std::string NeedChain(const Plan& plan, Index step);
// Who needs so many of its points.
std::string MaskText(const Plan& plan, Index step);

}  // namespace kpsa::engine
