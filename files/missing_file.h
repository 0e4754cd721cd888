// What is said of a file that is not there: which folder is missing, what its name may have been meant to be, or what
// of its kind is in its place.
#pragma once

#include <string>

#include "base/status.h"

namespace kpsa::engine {

// A part of a message, as " (did you mean "head.yaml"?)", "; there is no folder "rigs"" or "; its folder has no .yaml".
Suggestion InsteadOfMissing(const std::string& path);

}  // namespace kpsa::engine
