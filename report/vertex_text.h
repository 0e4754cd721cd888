// What moves a vertex, as text and as JSON.
#pragma once

#include <string>

#include "host/explain/vertex_story.h"

namespace kpsa::engine {

std::string VertexText(const VertexStory& story);
std::string VertexJson(const VertexStory& story);  // a document

}  // namespace kpsa::engine
