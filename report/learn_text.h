// What a subspace learnt, as text and as JSON.
#pragma once

#include <string>

#include "host/learning.h"

namespace kpsa::engine {

// `path`: of the new file.
std::string LearnJson(const LearnResult& result, const std::string& path, double seconds);
std::string LearnText(const LearnResult& result, const std::string& path, double seconds);

}  // namespace kpsa::engine
