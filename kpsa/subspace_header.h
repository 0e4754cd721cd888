// The metadata of a .kpsa file: what it says in words and JSON (docs/kpsa-file.md). For kpsa/subspace_file.
#pragma once

#include <map>
#include <string>

#include "files/safetensors.h"
#include "kpsa/subspace.h"

namespace kpsa::engine {

inline constexpr char kSubspaceKind[] = "kpsa-subspace";
inline constexpr int kDeepestEntry = 8;  // brackets of JSON

// All entries but the digests.
std::map<std::string, std::string> SubspaceHeader(const Subspace& s);

// with_lists: of a file before version 9, which has cues, ranges and the trained rig here. Errors: entries that are
// missing, of another kind, or beyond bounds.
Status ReadSubspaceHeader(const SafetensorsFile& file, bool with_lists, Subspace* s);

}  // namespace kpsa::engine
