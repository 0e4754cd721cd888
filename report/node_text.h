// Why a node is evaluated or not, as text and as JSON.
#pragma once

#include <string>

#include "host/explain/node_story.h"

namespace kpsa::engine {

std::string NodeStoryText(const NodeStory& story);
std::string NodeStoryJson(const NodeStory& story);

}  // namespace kpsa::engine
