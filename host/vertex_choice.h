// Vertices of a rig's meshes by what people name: a joint, a material, a mesh, the face, or a place.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/status.h"
#include "rig/build/rig_builder.h"

namespace kpsa::engine {

// Some vertices of one mesh, in the file's numbers, ascending.
struct MeshVertices {
  std::size_t mesh = 0;  // in rig.scene.meshes
  std::vector<Index> vertices;
};

// "0:99,120": ascending numbers as rig files and --vertices write them.
std::string RangesText(std::span<const Index> ascending);

// What moves with a joint (its weight is above zero), what a material covers, or all of a mesh; the first of these
// that has the name. Meshes without any are left out. Errors: no such name (the nearest is named), a joint that
// moves nothing.
enum class NameKind { kJoint, kMaterial, kMesh };
struct NamedVertices {
  NameKind kind = NameKind::kJoint;
  std::vector<MeshVertices> meshes;
};
Result<NamedVertices> FindVertices(const Rig& rig, std::string_view name);

// The face of a character: what moves with joints of the head, as they are commonly called, or else a mesh that is
// called so. Errors: neither is there.
Result<std::vector<MeshVertices>> FaceVertices(const Rig& rig);

// The vertex that is nearest to a place of the rest pose, before the rig's own deformers; of several the first.
struct NearVertex {
  std::size_t mesh = 0;
  Index vertex = 0;
  double distance = 0;  // metres
  Double3 at;           // where it is, world space
};
Result<NearVertex> NearestVertex(const Rig& rig, Double3 place);

// "Body" for a material without a name: material<index>.
std::string MaterialName(const gltf::Character& character, Index material);

}  // namespace kpsa::engine
