// What a bench measured, as tables of the viewer's page.
#pragma once

#include <string>
#include <vector>

#include "host/bench/bench_result.h"
#include "report/page_table.h"

namespace kpsa::engine {

// Times, clips, promise, reasons and the parts of errors; some may be empty.
std::vector<PageTable> BenchPageTables(const BenchResult& r, int runs, int threads);
// Of the nodes that take longest. fast: of the accelerated evaluation, or none. full_ms: of a frame.
PageTable ProfileTable(const std::vector<BenchNode>& full, const std::vector<BenchNode>& fast,
                       double full_ms);
// What a mean time is.
std::string TimesNote(bool cpu, int runs, int threads);

}  // namespace kpsa::engine
