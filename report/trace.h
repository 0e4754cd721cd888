// A profile as Chrome trace JSON (Trace Event Format, complete events), for ui.perfetto.dev and
// chrome://tracing.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "graph/profile.h"
#include "host/profile_run.h"

namespace kpsa::engine {

// One track for frames and one for each thread's computes, so that the events of a track nest. Times are
// exact to the nanosecond.
std::string TraceJson(const Plan& plan, const Profile& profile, std::span<const FrameSpan> frames,
                      std::span<const double> times);

}  // namespace kpsa::engine
