#include "rig/character/shape_file.h"

#include <algorithm>
#include <cmath>

#include "files/npz.h"
#include "files/obj.h"
#include "files/suffix.h"
#include "gltf/import.h"
#include "rig/character/character_graph.h"

namespace kpsa::engine {
namespace {

constexpr std::uint64_t kMaxBytes = std::uint64_t{1} << 30;

Status TooMany(std::size_t shapes, const std::string& path) {
  return Status::Invalid("has {} shapes or more; at most {} are supported", shapes, kMaxMorphTargets)
      .At({path});
}

Result<ShapeFile> FromNpz(const std::string& path) {
  Result<Npz> npz = ReadNpz(path, kMaxBytes);
  if (!npz.ok()) return npz.status();
  if (npz->arrays.size() > kMaxMorphTargets) return TooMany(npz->arrays.size(), path);
  ShapeFile file{path, {}};
  for (NpzArray& array : npz->arrays) {
    const bool floats = array.type == NpzType::kFloat32 || array.type == NpzType::kFloat64;
    if (array.shape.size() != 2 || array.shape[1] != 3 || array.shape[0] >= kNoIndex || !floats) {
      return Status::Invalid("array \"{}\" has shape ({}){}, expected floats of shape (V, 3)", array.name,
                             fmt::join(array.shape, ", "), floats ? "" : " of no floats")
          .At({path});
    }
    FileShape shape;
    shape.name = array.name;
    shape.vertex_count = static_cast<Index>(array.shape[0]);
    shape.values = array.Floats();
    array.bytes = {};
    file.shapes.push_back(std::move(shape));
  }
  return file;
}

Result<ShapeFile> FromObj(const std::string& path) {
  Result<std::vector<ObjShape>> objects = ReadObj(path);
  if (!objects.ok()) return objects.status();
  if (objects->size() > kMaxMorphTargets) return TooMany(objects->size(), path);
  ShapeFile file{path, {}};
  for (ObjShape& object : *objects) {
    FileShape shape;
    shape.name = std::move(object.name);
    shape.vertex_count = static_cast<Index>(object.positions.size() / 3);
    shape.displacements = false;
    shape.values = std::move(object.positions);
    file.shapes.push_back(std::move(shape));
  }
  return file;
}

Result<ShapeFile> FromGltf(const std::string& path) {
  Result<gltf::Character> character = gltf::LoadGltf(path);
  if (!character.ok()) return character.status();
  const std::vector<std::string> names = character->UniqueNames();
  ShapeFile file{path, {}};
  std::uint64_t bytes = 0;
  for (const Index n : character->MeshNodes()) {
    const gltf::Mesh& mesh = character->meshes[character->nodes[n].mesh];
    // Many nodes may show one mesh
    if (mesh.targets.empty()) bytes += 4 * mesh.positions.size();
    for (const gltf::MorphTarget& target : mesh.targets) bytes += 8 * target.deltas.size();
    if (bytes > kMaxBytes)
      return Status::Invalid("has shapes of more than {} bytes, the most that is read", kMaxBytes).At({path});
    const std::size_t shapes = file.shapes.size() + std::max<std::size_t>(mesh.targets.size(), 1);
    if (shapes > kMaxMorphTargets) return TooMany(shapes, path);
    FileShape shape;
    shape.mesh = names[n];
    shape.vertex_count = static_cast<Index>(mesh.vertex_count());
    if (mesh.targets.empty()) {
      shape.name = names[n];
      shape.displacements = false;
      shape.values = mesh.positions;
      file.shapes.push_back(std::move(shape));
      continue;
    }
    shape.displacements = true;
    for (std::size_t t = 0; t < mesh.targets.size(); ++t) {
      shape.name = mesh.targets[t].name.empty() ? std::to_string(t) : mesh.targets[t].name;
      shape.vertices = mesh.targets[t].vertices;
      shape.values = mesh.targets[t].deltas;
      file.shapes.push_back(shape);
    }
  }
  return file;
}

}  // namespace

Result<ShapeFile> ReadShapeFile(const std::string& path) {
  const std::string suffix = FileSuffix(path);
  const bool gltf = suffix == ".glb" || suffix == ".gltf" || suffix == ".vrm";
  if (!gltf && suffix != ".npz" && suffix != ".obj")
    return Status::Invalid("expected a file that ends in .npz, .obj, .glb, .gltf or .vrm").At({path});
  Result<ShapeFile> file = gltf ? FromGltf(path) : suffix == ".npz" ? FromNpz(path) : FromObj(path);
  if (!file.ok()) return file;
  if (file->shapes.empty()) return Status::Invalid("has no shapes").At({path});
  for (const FileShape& shape : file->shapes) {
    for (std::size_t i = 0; i < shape.values.size(); ++i) {
      if (std::isfinite(shape.values[i])) continue;
      return Status::Invalid("shape \"{}\": vertex {} is not finite", shape.name, i / 3).At({path});
    }
  }
  return file;
}

}  // namespace kpsa::engine
