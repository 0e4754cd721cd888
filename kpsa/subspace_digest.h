// What tells a damaged .kpsa file: numbers that are only a little wrong would not be seen.
#pragma once

#include <string>

#include "kpsa/subspace.h"

namespace kpsa::engine {

// Of all that the file says but the kept modes, which have a digest of their own.
std::string ContentDigest(const Subspace& s);
std::string ModesDigest(const Subspace& s);

}  // namespace kpsa::engine
