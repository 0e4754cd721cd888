// Cues, trained ranges, the trained rig and the record of the training as tensors of a .kpsa file (docs/kpsa-file.md),
// from version 9 on: they are most of a file's words, and tensors are read in a tenth of the time of JSON. For
// kpsa/subspace_file.
#pragma once

#include "files/safetensors.h"
#include "kpsa/subspace.h"

namespace kpsa::engine {

inline constexpr std::size_t kMaxCues = 1u << 16;  // and ranges, and names of other lists
inline constexpr std::size_t kMaxOutputs = 1u << 12;
inline constexpr std::uint64_t kMaxPoints = 1u << 28;

void AddLists(const Subspace& s, SafetensorsWriter* writer);
// Errors: tensors that are missing or of another kind, sizes that do not fit each other, numbers beyond bounds.
Status ReadLists(const SafetensorsFile& file, Subspace* s);

}  // namespace kpsa::engine
