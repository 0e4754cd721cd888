// Which names somebody may have meant.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "base/status.h"

namespace kpsa::engine {

// Of the candidates, all that are equally near to the word and nearer than the others; none where nothing is near.
// Case does not count.
std::vector<std::string> NearNames(std::string_view word, const std::vector<std::string>& candidates);

// What to say after a wrong name: "did you mean "rotateX"?", "did you mean "rotateX", "rotateY" or "rotateZ"?", or,
// where no candidate is near, what there is: "; there is translate, rotate, scale and 12 more".
Suggestion NearOrAll(std::string_view word, const std::vector<std::string>& candidates,
                     const std::vector<std::string>& all);

}  // namespace kpsa::engine
