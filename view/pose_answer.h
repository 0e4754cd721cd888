// A pose file, for the page's sliders.
#pragma once

#include <string>
#include <string_view>

#include "base/status.h"
#include "rig/build/rig_builder.h"

namespace kpsa::engine {

// {"set": {plug: number}, "clip"?, "time"?} of the text of a pose file (rig/build/rig_builder.h), numbers in the units of
// the rig's file, vectors by their components. Errors: those of the file, and what is no number.
Result<std::string> PoseAnswer(const Rig& rest, std::string_view text);

}  // namespace kpsa::engine
