// A rig file in its canonical form: what is written, in one way of writing it. Sections come in the order of
// docs/rig-format.md, one entry a line in braces where it fits, else in blocks of two spaces; strings are quoted
// where YAML needs it, numbers of numeric attributes are in their shortest form. Comments stay with their entries.
#pragma once

#include <string>
#include <string_view>

#include "base/status.h"
#include "files/yaml_document.h"
#include "graph/node_registry.h"
#include "rig/file/comments.h"

namespace kpsa::engine {

// The text, which reads back as the same values. The registry says which attributes are numbers. An error for
// what has no other form: tags.
Result<std::string> FormatRig(const YamlNode& root, const NodeRegistry& registry,
                              const CommentMap& comments = {});

// Whether the text of a YAML file has comments. Also true where it is no such text but has a #.
bool HasComments(std::string_view text);

}  // namespace kpsa::engine
