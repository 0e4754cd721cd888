// Why a frame is a hit, a blend or a miss, as text and as JSON.
#pragma once

#include <string>

#include "host/explain/decision_story.h"

namespace kpsa::engine {

std::string DecisionText(const DecisionStory& story);
std::string DecisionStoryJson(const DecisionStory& story);

}  // namespace kpsa::engine
