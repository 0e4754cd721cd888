// Files with shapes that a mesh is to be pulled to: .npz, .obj, and glTF files.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/status.h"
#include "base/types.h"

namespace kpsa::engine {

struct FileShape {
  std::string name;
  std::string mesh;  // of a glTF file: its mesh node, as in outputs; else ""
  Index vertex_count = 0;
  std::optional<bool> displacements;  // not positions; unset: the file does not say
  std::optional<std::vector<Index>>
      vertices;               // ascending: whose the values are, others are 0; unset: all vertices
  std::vector<float> values;  // xyz, as the file has them; finite
};

struct ShapeFile {
  std::string path;
  std::vector<FileShape> shapes;  // in the file's order
};

// By suffix. .npz: each array [V, 3] of floats, by its name. .obj: see files/obj.h. .glb, .gltf and .vrm: the morph
// targets of each mesh node of the scene; of one without any, the mesh itself, named as its node. Errors: those of the
// readers, other suffixes, an array of another shape or type, numbers that are not finite (with the vertex), no shapes,
// more than kMaxMorphTargets of them or than 1 GiB.
Result<ShapeFile> ReadShapeFile(const std::string& path);

}  // namespace kpsa::engine
