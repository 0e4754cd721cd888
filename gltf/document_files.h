// The files that a glTF document is in.
#pragma once

#include <string>
#include <vector>

#include "base/status.h"

namespace kpsa::engine::gltf {

// Those of its buffers and images beside the document itself, relative to its folder, each once. URIs that nobody may
// follow are left out. Errors: it cannot be read, or is no glTF.
Result<std::vector<std::string>> FilesBeside(const std::string& path);

}  // namespace kpsa::engine::gltf
