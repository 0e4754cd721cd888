// What the page and the server say to each other (docs/viewer-data.md, "The live server").
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "base/status.h"
#include "view/live_rig.h"

namespace kpsa::engine {

struct EvaluateRequest {
  std::string id = "null";  // a JSON number or null, given back
  FrameRequest frame;
};

// Any bytes. Errors: what is no request, or is nested too deeply.
Result<EvaluateRequest> ParseEvaluate(std::string_view body);
// The bytes of the answer.
std::string EvaluateAnswer(const EvaluateRequest& request, const LiveFrame& frame, std::uint64_t generation);

// {"problems": [...]}, and the list alone; suggestions apart from their messages. As warnings, or as errors.
std::string ProblemsAnswer(const Status& status);
std::string ProblemList(const Status& status, bool warnings = false);

// "17" of a query: a whole number that is not negative, or -1 where it may be. None for anything else.
std::optional<std::int64_t> ParseWhole(std::string_view text, bool or_minus_one = false);

}  // namespace kpsa::engine
