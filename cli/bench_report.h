// A bench's result as text and as JSON.
#pragma once

#include <string>

#include "cli/bench_run.h"

namespace kpsa {

struct BenchContext {
  std::string rig;                  // as the user named it
  std::optional<std::string> kpsa;  // --kpsa
  BenchOptions options;
};

// One object; times in milliseconds, lengths in metres; -1 where an error is not finite.
std::string BenchJson(const BenchResult& result, const BenchContext& context);
// For people, with the next command.
std::string FramesText(const BenchResult& result);  // a table of all frames
std::string BenchText(const BenchResult& result, const BenchContext& context);

}  // namespace kpsa
