// Why a stack was not trained, as text and as JSON.
#pragma once

#include <string>

#include "host/checks/stack_cost.h"

namespace kpsa::engine {

std::string NotWorthItText(const StackCost& cost, const std::string& rig);
std::string NotWorthItJson(const StackCost& cost);

}  // namespace kpsa::engine
