// The node reference, from the registry: as Markdown, as text and as JSON.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "graph/node_def.h"

namespace kpsa::engine {

using NodeDefs = std::vector<const NodeDef*>;

// By category. `has_picture`: of the type, nodes/TYPE.png beside the document.
std::string NodesMarkdown(const NodeDefs& defs,
                          const std::function<bool(const std::string& type)>& has_picture);
std::string NodesText(const NodeDefs& defs);  // a line a type
std::string NodeText(const NodeDef& def);     // with its attributes
std::string NodesJson(const NodeDefs& defs);

}  // namespace kpsa::engine
