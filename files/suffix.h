// What kind of file a name says.
#pragma once

#include <string>

namespace kpsa::engine {

// The lower-case suffix of a path with its dot, "" where there is none.
std::string FileSuffix(const std::string& path);

}  // namespace kpsa::engine
