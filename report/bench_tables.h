// Tables from what `kpsa bench --json` printed: one document a rig, each with one side or several.
#pragma once

#include <string>
#include <vector>

#include "base/status.h"

namespace kpsa::engine {

struct BenchDocument {
  std::string path;
  std::string reference;  // beside the paper mode of this rig; may be empty
};

// Markdown: what is reached, what it costs, and how its errors are composed; `with_any`: sides that accept
// every frame, too. Errors: a file that is no bench of this program.
Result<std::string> BenchTables(const std::vector<BenchDocument>& documents, bool with_any = true);

// The frames of all sides, a line each, as comma-separated values; lengths in metres, times in milliseconds, what is
// not known empty. The parts of an error are those of every frame reconstructed, of subspaces trained with
// --keep-modes. Errors: those of BenchTables.
Result<std::string> BenchFrames(const std::vector<std::string>& paths);

}  // namespace kpsa::engine
