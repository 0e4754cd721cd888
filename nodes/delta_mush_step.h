// What deltaMush gives of itself to those who reconstruct its smoothed points (graph/last_step.h).
#pragma once

#include <memory>

#include "base/status.h"
#include "graph/last_step.h"
#include "graph/node_def.h"
#include "nodes/kernels/delta_mush.h"

namespace kpsa::engine {

DeltaMushSettings MushSettings(const Structural& structural);
// Null where nothing changes, and under a falloff.
Result<std::shared_ptr<const LastStep>> MushLastStep(const Structural& structural);

}  // namespace kpsa::engine
