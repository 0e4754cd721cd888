// What a glTF file says of how its materials look, for caches that are written of it. The reader of what
// deforms (gltf/import.h) reads none of this but the base colour's factor.
#pragma once

#include <string>
#include <vector>

#include "files/point_cache.h"

namespace kpsa::engine::gltf {

// Adds to the cache's materials, whose names and base colours are known, what the file says of their other
// factors and of alpha, and the images of base colours that the .glb holds, each once. An image that is not
// carried over is a note, and so is a file that cannot be read.
void ReadShading(const std::string& path, PointCache* cache, std::vector<std::string>* notes);

}  // namespace kpsa::engine::gltf
