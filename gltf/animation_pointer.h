// KHR_animation_pointer: channels that name what they animate by a JSON pointer. Nothing outside gltf/
// includes this.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "base/status.h"

namespace kpsa::engine::gltf {

// Makes plain channels of those of `reduced` (the checked copy of `root`) that point at translation,
// rotation, scale or weights of a node; channels that point elsewhere are left out, with a warning for each
// animation. Errors: a pointer that is none, that names no node, and a node beside it.
Status ResolvePointers(const nlohmann::json& root, nlohmann::json* reduced,
                       std::vector<std::string>* warnings);

}  // namespace kpsa::engine::gltf
