// What a cache of a rig is shown with: parts, materials, texture coordinates, colours, which normals are one.
#pragma once

#include <string>
#include <vector>

#include "files/point_cache.h"
#include "rig/build/rig_builder.h"

namespace kpsa::engine {

// Fills it in for a cache whose meshes are `meshes` of the rig's. Notes say what is not carried over.
void AddLook(const Rig& rig, const std::vector<std::size_t>& meshes, PointCache* cache,
             std::vector<std::string>* notes);

}  // namespace kpsa::engine
