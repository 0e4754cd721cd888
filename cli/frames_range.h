// The times that --frames and --times ask for.
#pragma once

#include <vector>

#include "base/status.h"
#include "cli/common.h"
#include "cli/number_lists.h"
#include "host/rig_frames.h"

namespace kpsa::engine {

// The times of --frames or --times in seconds. Without them: when the pose file says that it is; else every
// frame of the clip that plays, from 0 to its end; time 0 alone if none plays.
Result<std::vector<double>> SampleTimes(const Flags& flags, const OpenRig& open);
// Whether all refusals of --frames and --times pass, before a rig is loaded.
Status CheckTimeFlags(const Flags& flags);

}  // namespace kpsa::engine
