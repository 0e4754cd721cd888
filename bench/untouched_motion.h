// The clips of an untouched character, as curves of its motions.
#pragma once

#include <vector>

#include "bench/untouched_design.h"

namespace kpsa::engine::untouched {

inline constexpr double kClipFps = 30;

// Values by motion and frame; those of motions that rest in the clip are empty. 3 to 6 seconds. The curves of
// training reach the ends of the clip's share of the ranges; those of the test stay within, but for
// overshoots of a few per cent.
using Curves = std::vector<std::vector<double>>;
Curves MakeCurves(const Design& design, const ClipDesign& clip, std::uint64_t seed);

}  // namespace kpsa::engine::untouched
