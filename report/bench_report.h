// A bench's result as text and as JSON.
#pragma once

#include <string>

#include "host/bench/bench.h"
#include "report/tolerance_text.h"

namespace kpsa::engine {

struct BenchContext {
  std::string rig;                // as the user named it
  std::vector<std::string> kpsa;  // --kpsa
  BenchOptions options;
  bool set =
      false;  // controls hold other values than the clips and the rig give them: learning would not see them
};

// One object, that of the first side; those of the others stand in its list "beside". Times in milliseconds,
// lengths in metres; -1 where an error is not finite.
std::string BenchJson(const std::vector<BenchResult>& results, const BenchContext& context);
// For people, with the next command.
std::string BenchText(const std::vector<BenchResult>& results, const BenchContext& context);
// What a bench calls what it tells of tolerances.
ToleranceWords BenchWords(const BenchResult& r);
// A table of all frames, for every side.
std::string FramesText(const std::vector<BenchResult>& results);

}  // namespace kpsa::engine
