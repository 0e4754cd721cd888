// Between the engine's statuses and the face's problems.
#pragma once

#include "base/status.h"
#include "kpsa/result.h"

namespace kpsa::engine {

Problems ProblemsOf(const Status& status);

}  // namespace kpsa::engine
