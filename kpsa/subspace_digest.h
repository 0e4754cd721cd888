// What tells a damaged .kpsa file: numbers that are only a little wrong would not be seen.
#pragma once

#include <map>
#include <string>

#include "files/safetensors.h"
#include "kpsa/subspace.h"

namespace kpsa::engine {

// Of all that the file says but the kept modes, which have a digest of their own. header: SubspaceHeader(s), or what
// the file has of it, which is the same unless one of both is damaged.
std::string ContentDigest(const Subspace& s, const std::map<std::string, std::string>& header);
std::string ModesDigest(const Subspace& s);

// What a file says, consistent in all sizes and indices, whatever its digests are. For ReadSubspace, and for tests that
// mend digests.
Result<Subspace> SubspaceContent(const SafetensorsFile& file, KeptModes modes);

}  // namespace kpsa::engine
