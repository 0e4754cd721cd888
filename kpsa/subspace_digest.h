// What tells a damaged .kpsa file: numbers that are only a little wrong would not be seen.
#pragma once

#include <string>

#include "files/safetensors.h"
#include "kpsa/subspace.h"

namespace kpsa::engine {

// Of all that the file says but the kept modes, which have a digest of their own.
std::string ContentDigest(const Subspace& s);
std::string ModesDigest(const Subspace& s);

// What a file says, consistent in all sizes and indices, whatever its digests are. For ReadSubspace, and for tests that
// mend digests.
Result<Subspace> SubspaceContent(const SafetensorsFile& file, KeptModes modes);

}  // namespace kpsa::engine
