// Tables and plots from what `kpsa bench --json` printed: one document a rig, each with one side or several.
#pragma once

#include <string>
#include <vector>

#include "base/status.h"
#include "report/line_plot.h"

namespace kpsa::engine {

struct BenchDocument {
  std::string path;
  std::string reference;  // beside the paper mode of this rig; may be empty
};

// Markdown: what is reached, what it costs, and how its errors are composed; `with_any`: sides that accept
// every frame, too. Errors: a file that is no bench of this program.
Result<std::string> BenchTables(const std::vector<BenchDocument>& documents, bool with_any = true);

// Two plots for each side that has errors by frame: projection, cueing and total of every frame
// reconstructed; and the error with SoftCache, misses marked. Errors also: no side has them.
Result<std::vector<LinePlot>> BenchPlots(const std::string& path);

}  // namespace kpsa::engine
