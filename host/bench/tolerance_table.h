// What other tolerances would give: how many poses or frames hit, and how fast that is.
#pragma once

#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "kpsa/calibration.h"

namespace kpsa::engine {

// What is expected at a tolerance, in scene units (of light a number).
struct ToleranceRow {
  double tolerance = 0;
  double hits = 0;                                            // share
  double speedup = std::numeric_limits<double>::quiet_NaN();  // misses included; NaN: nothing was timed
  double worst = std::numeric_limits<double>::quiet_NaN();    // error that is accepted, in tolerances; NaN:
                                                              // not known
};
// Hits must not fall as the tolerance grows, nor must speedup, but for the 1 of tolerances that allow no hit.
using ToleranceModel = std::function<ToleranceRow(double tolerance)>;

// The smallest tolerance of a fine grid (two digits, steps of at most 10 %) that reaches a speedup.
struct ReachedSpeedup {
  double wanted = 0;
  bool reached = false;
  ToleranceRow row;  // that one; or the smallest with the largest speedup
};

struct ToleranceTable {
  std::vector<ToleranceRow> rows;  // ascending; none where the tolerance in force is 0 or any
  std::size_t in_force = 0;
  std::optional<ReachedSpeedup> reached;  // where a speedup is wanted
};

// Round numbers from a quarter of a tolerance to eight times it, and itself; none for 0 or for any.
std::vector<double> TolerancesAround(double tolerance);
// wanted_speedup 0: none. largest: from there on nothing changes.
ToleranceTable MakeToleranceTable(double in_force, double largest, double wanted_speedup,
                                  const ToleranceModel& model);

// Of pairs that a tolerance can accept; 0 of none.
double LargestError(std::span<const CalibrationPair> pairs);

// full / (accelerated + the share of misses * what one adds, of a full evaluation): a miss costs both, or a
// part where parts miss by themselves; NaN where it is not known. 1 where nothing is ever a hit: then nothing
// is measured.
double SpeedupWithMisses(double full_ms, double accelerated_ms, double hits, bool ever_hits = true,
                         double miss = 1);

}  // namespace kpsa::engine
