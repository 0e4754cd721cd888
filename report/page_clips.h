// The frames of a report (docs/viewer-data.md): positions, verdicts, times and errors.
#pragma once

#include <span>
#include <vector>

#include "base/status.h"
#include "host/bench/bench_result.h"
#include "host/clip_record.h"
#include "host/watch.h"
#include "report/page_data.h"

namespace kpsa::engine {

struct PageClips {
  std::vector<ClipRecord> records;           // at least one, all with as many vertices
  const BenchResult* bench = nullptr;        // of the same clips in that order; null: nothing is accelerated
  std::vector<std::vector<double>> full_us;  // [clips][frames] where there is no bench; may be empty
};

// What positions are stored to, in metres.
struct PageSteps {
  double shape = 0, residual = 0;
};
// A tenth and a sixteenth of the tolerance; without one, as if it were a thousandth of the diagonal of all frames.
PageSteps StepsOf(const PageClips& clips);

// accelerated, tolerance, shape, clips and reasons. rest: [V, 3]. The watch counts modes.
Status PutClips(const PageClips& clips, std::span<const float> rest, const Watch& watch, PageData* page);

}  // namespace kpsa::engine
