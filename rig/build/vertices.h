// Inside of the rig builder: vertices as rig files list them. Nothing outside rig/build includes this.
#pragma once

#include <string>
#include <vector>

#include "base/types.h"
#include "files/yaml_document.h"

namespace kpsa::engine {

// "0:99,120" (both ends included), a number, or a list of numbers, of `count` vertices of what `of` names. False,
// with its errors, where it is none of these.
bool ReadVertices(const YamlNode& node, std::size_t count, const std::string& of,
                  std::vector<Index>* vertices, YamlErrors* errors);

}  // namespace kpsa::engine
