// What this build is.
#pragma once

#include <string>

namespace kpsa::engine {

// "kpsa 0.1.0 (commit)", the compiler, the vector unit in use and the libraries, a line each.
std::string VersionText();

}  // namespace kpsa::engine
