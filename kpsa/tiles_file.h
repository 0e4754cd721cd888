// The tiles of a subspace as tensors of a .kpsa file. For kpsa/subspace_file.
#pragma once

#include "files/safetensors.h"
#include "kpsa/subspace.h"

namespace kpsa::engine {

void AddTiles(const Subspace& s, SafetensorsWriter* writer);
// Of the outputs that *s has already. file_digest: of all that the file says, which then stands for the tiles, too
// (TileMap::digest); "": of none. Errors: tensors that are missing or do not fit together.
Status ReadTiles(const SafetensorsFile& file, const std::string& file_digest, Subspace* s);

}  // namespace kpsa::engine
