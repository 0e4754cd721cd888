// What a fresh subspace is expected to gain, by its calibration and by what its check timed.
#pragma once

#include "host/bench/tolerance_table.h"
#include "host/checks/subspace_check.h"
#include "kpsa/calibration.h"
#include "kpsa/subspace.h"

namespace kpsa::engine {

// Misses included, with the share of them that ExpectedHitRate says.
double ExpectedSpeedup(const SubspaceCheck& check, const Calibration& calibration);
// The same at other tolerances. wanted_speedup 0: none.
ToleranceTable TrainedTolerances(const Subspace& subspace, const SubspaceCheck& check, double wanted_speedup);

}  // namespace kpsa::engine
