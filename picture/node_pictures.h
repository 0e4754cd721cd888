// Pictures for the node reference: what each deformer does to a small shape, before and after.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/status.h"
#include "graph/node_registry.h"

namespace kpsa::engine {

// A PNG of 320 x 160 pixels: the shape as it comes to the node, and as it leaves it. The same bytes
// everywhere.
struct NodePicture {
  std::string type;
  std::vector<std::uint8_t> png;
};
// Whether the reference has a picture of the type.
bool HasNodePicture(const std::string& type);
// Of all types that have one, by name. Errors: an example that cannot be evaluated, with its type.
Result<std::vector<NodePicture>> DrawNodePictures(const NodeRegistry& registry);
// Writes <folder>/<type>.png of all of them; errors of the folder or its files, before any is written.
Status WriteNodePictures(const NodeRegistry& registry, const std::string& folder, bool force);

}  // namespace kpsa::engine
