// Tables and figures of the viewer's page (docs/viewer-data.md): what was measured, and what training promised.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "host/acceleration.h"
#include "host/bench/bench_result.h"
#include "host/full_times.h"
#include "report/page_data.h"

namespace kpsa::engine {

struct PageTables {
  const BenchResult* bench = nullptr;  // null: nothing is accelerated
  FullTimes full;                      // then
  std::vector<AppliedSubspace> applied;
  std::vector<std::string> notes;  // of the report itself
  int runs = 0, threads = 1;
  std::size_t points = 0;  // V
};

// summary, tolerances and tables.
void PutTables(const PageTables& tables, PageData* page);

}  // namespace kpsa::engine
