// Inside of the starter rig's writer: numbers and names as YAML, and text as comments. Nothing outside rig/build
// includes this.
#pragma once

#include <string>
#include <vector>

#include "rig/character/clip_motion.h"

namespace kpsa::engine {

// To multiples of the step, with some slack: 0.30000000000000004 stays 0.3.
MotionRange RoundedOut(MotionRange range, double step);
std::string Rounded(double value);
// A plain YAML scalar where that is safe in any context, else a double-quoted one.
std::string Quoted(const std::string& text, bool in_flow);
std::string QuotedList(const std::vector<std::string>& names);
// A comment holds one line.
std::string InComment(std::string text);

}  // namespace kpsa::engine
