// The metadata of a .kpsa file: what it says in words and lists (docs/kpsa-file.md). For kpsa/subspace_file.
#pragma once

#include <map>
#include <string>

#include "files/safetensors.h"
#include "kpsa/subspace.h"

namespace kpsa::engine {

inline constexpr char kSubspaceKind[] = "kpsa-subspace";

// Of all entries but the digests, in the order of their digest.
inline constexpr const char* kHeaderKeys[] = {"cues",  "frame",   "kind",     "outputs", "ranges", "rigHash",
                                              "space", "summary", "training", "units",   "version"};

// All entries of kHeaderKeys. The version is the oldest that knows all of the subspace: one without any of what is
// new is what it was before.
std::map<std::string, std::string> SubspaceHeader(const Subspace& s);

// Errors: entries that are missing, of another kind, or beyond bounds.
Status ReadSubspaceHeader(const SafetensorsFile& file, Subspace* s);

}  // namespace kpsa::engine
