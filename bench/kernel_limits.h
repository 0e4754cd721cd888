// What one core does at best, measured in the run that uses it, with the vector unit in use.
#pragma once

#include <cstddef>

namespace kpsa::engine {

// Bytes a nanosecond of a = b + s c over three arrays of floats that hold `bytes` together: what caches of that
// size give.
double BytesANanosecond(std::size_t bytes);
// Additions and multiplications a nanosecond, of multiply-adds that do not wait for each other.
double OperationsANanosecond();

}  // namespace kpsa::engine
