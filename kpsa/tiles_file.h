// The tiles of a subspace as tensors of a .kpsa file. For kpsa/subspace_file.
#pragma once

#include "files/safetensors.h"
#include "kpsa/subspace.h"

namespace kpsa::engine {

void AddTiles(const Subspace& s, SafetensorsWriter* writer);
// Of the outputs that *s has already. Errors: tensors that are missing or do not fit together.
Status ReadTiles(const SafetensorsFile& file, Subspace* s);

}  // namespace kpsa::engine
