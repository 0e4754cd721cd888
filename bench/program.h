// A program that a bench runs, and what it took.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "base/status.h"

namespace kpsa::engine {

struct ProgramCost {
  double cpu = 0;              // seconds, of all of its threads
  std::size_t peak_bytes = 0;  // of memory that was resident
};

// Its standard output goes into the file; what it says comes to stderr. Errors: it cannot be started, it fails.
Result<ProgramCost> RunProgram(std::vector<std::string> arguments, const std::string& output);

}  // namespace kpsa::engine
