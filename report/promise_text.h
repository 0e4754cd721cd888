// What a bench says of what was promised.
#pragma once

#include <string>

#include "host/bench/promise.h"

namespace kpsa::engine {

// "kept: 0 of 240 frames beyond 0.4 mm (promised 5 %) ..." or "PROMISE BROKEN: 14.5 % > 3 % ...", then
// lines about the worst accepted frame and what helps; every line after the first begins with `indent`.
std::string PromiseText(const Promise& promise, const std::string& indent);

}  // namespace kpsa::engine
