// What a rig's meshes look like in pictures, whatever their pose: colours, textures, and which edges are hard.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "picture/texture.h"
#include "rig/build/rig_builder.h"

namespace kpsa::engine {

// Of one mesh. Its corners are where triangles meet that have a normal, colour and texture coordinates in common:
// vertices of the file, and each triangle's own where the file gives it no normals, so that it is flat.
struct MeshLook {
  std::vector<Index> points;     // [C] of the mesh, by corner
  std::vector<Index> triangles;  // 3 a triangle of the mesh, corners
  std::vector<Index> smooth;     // [C] the first of the corners that share a normal
  std::vector<float> colors;     // 3C, linear; empty: clay
  std::vector<float> uvs;        // 2C, of the corner's texture; empty where there are no textures
  std::vector<Index> texture;    // [C] in `textures`, or kNoIndex; likewise empty
  std::vector<SurfaceTexture> textures;
};
using RigLook =
    std::vector<MeshLook>;  // by mesh of the rig's scene; empty ones for those that nobody asked for

// Of some meshes, with the textures of their base colours. Each picture is decoded once; together they have a
// budget, and what is beyond it, damaged or unknown is left out with a note.
RigLook LookOf(const Rig& rig, const std::vector<std::size_t>& meshes, bool textures,
               std::vector<std::string>* notes);

}  // namespace kpsa::engine
