// What tells a damaged .kpsa file: numbers that are only a little wrong would not be seen.
#pragma once

#include <map>
#include <string>

#include "files/safetensors.h"
#include "kpsa/subspace.h"

namespace kpsa::engine {

inline constexpr char kDigest[] = "digest", kModes[] = "modes", kModesDigest[] = "modesDigest";

// Of all that a file says but the digests, and but the kept modes, which have a digest of their own.
std::string FileDigest(const SafetensorsFile& file);
std::string ModesDigest(const Subspace& s);
// Before version 9: of all that this program knows of it. metadata: the file's.
std::string ContentDigest(const Subspace& s, const std::map<std::string, std::string>& metadata);

// The version of a file. Errors: another kind of file; a version that this program does not read.
Result<int> SubspaceVersion(const SafetensorsFile& file);
// What a file says, consistent in all sizes and indices, whatever its digests are. For ReadSubspace, and for tests that
// mend digests.
Result<Subspace> SubspaceContent(const SafetensorsFile& file, KeptModes modes);

}  // namespace kpsa::engine
