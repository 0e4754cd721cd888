// Numbers, frame ranges and lists as they are typed. All refusals are errors of usage that say what was expected.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "base/status.h"
#include "base/types.h"

namespace kpsa::engine {

// A finite decimal number, and nothing else. `what` ("--fps") is for messages.
Result<double> ParseNumber(std::string_view what, std::string_view text);
// A whole number within [low, high].
Result<int> ParseCount(std::string_view what, std::string_view text, int low, int high);
// "A:B", "A:B:S" or "A": frames A to B, both included, every S-th (S from 1 on). At most kMaxSamples.
Result<std::vector<std::int64_t>> ParseFrames(std::string_view text);
// "T,T,...": finite seconds in any order. At most kMaxSamples.
Result<std::vector<double>> ParseTimes(std::string_view text);
// "X,Y,Z": three finite numbers, metres.
Result<Double3> ParsePlace(std::string_view what, std::string_view text);
// "0:99,120": indices and ranges with both ends, ascending and each once, below `total`.
Result<std::vector<Index>> ParseIndices(std::string_view what, std::string_view text, Index total);

}  // namespace kpsa::engine
