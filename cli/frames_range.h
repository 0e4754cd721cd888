// Numbers, frame ranges and lists of times as they are typed. All refusals are errors of usage that say what
// was expected.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "base/status.h"
#include "cli/common.h"
#include "host/rig_frames.h"

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

// The times of --frames or --times in seconds. Without them: when the pose file says that it is; else every
// frame of the clip that plays, from 0 to its end; time 0 alone if none plays.
Result<std::vector<double>> SampleTimes(const Flags& flags, const OpenRig& open);
// Whether all refusals of --frames and --times pass, before a rig is loaded.
Status CheckTimeFlags(const Flags& flags);

}  // namespace kpsa::engine
