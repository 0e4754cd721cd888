// What other programs call the node types of this one.
#pragma once

#include <span>
#include <string_view>

#include "base/status.h"
#include "graph/node_registry.h"

namespace kpsa::engine {

// A name in small letters, without what stands between its words, and what stands here for it.
struct OtherTypeName {
  std::string_view name, here;
};
std::span<const OtherTypeName> OtherTypeNames();

// For a message about a type that the registry has not: those with a name like it, or what stands here for a node, modifier,
// constraint or operator of that name in Maya, Blender, Houdini or Unreal.
Suggestion SuggestType(std::string_view type, const NodeRegistry& registry);

}  // namespace kpsa::engine
