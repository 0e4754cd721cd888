#include "host/checks/expected_speedup.h"

namespace kpsa::engine {

double ExpectedSpeedup(const SubspaceCheck& check, const Calibration& calibration) {
  return SpeedupWithMisses(check.full_ms, check.accelerated_ms, ExpectedHitRate(calibration),
                           calibration.threshold.tau >= 0);
}

ToleranceTable TrainedTolerances(const Subspace& subspace, const SubspaceCheck& check,
                                 double wanted_speedup) {
  return MakeToleranceTable(
      subspace.tolerance, LargestError(subspace.calibration), wanted_speedup, [&](double tolerance) {
        const Calibration calibration =
            Calibrate(subspace.calibration, tolerance, subspace.violation_rate, subspace.blend_start);
        ToleranceRow row;
        row.tolerance = tolerance;
        row.hits = ExpectedHitRate(calibration);
        row.speedup = ExpectedSpeedup(check, calibration);
        return row;
      });
}

}  // namespace kpsa::engine
