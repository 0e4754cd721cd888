#include "cli/cache_look.h"

#include <filesystem>

#include "gltf/shading.h"
#include "rig/character/smoothing.h"

namespace kpsa::engine {

void AddLook(const Rig& rig, const std::vector<std::size_t>& meshes, PointCache* cache,
             std::vector<std::string>* notes) {
  const gltf::Character& character = *rig.character;
  cache->rig = std::filesystem::path(rig.path).filename().string();
  cache->clip = rig.scene.clip.value_or("");
  for (const gltf::Material& material : character.materials)
    cache->materials.push_back({.name = material.name, .base_color = material.base_color});
  if (rig.references.empty()) {
    gltf::ReadShading(character.path, cache, notes);
  } else if (!cache->materials.empty()) {
    notes->push_back("materials have their base colours alone: the rig has references");
  }
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    const CharacterMesh& from = rig.scene.meshes[meshes[i]];
    const gltf::Mesh& mesh = character.meshes[character.nodes[from.gltf_node].mesh];
    PointCacheMesh& to = cache->meshes[i];
    to.uvs = mesh.uvs;
    to.colors = mesh.colors;
    to.smooth = SmoothVertices(mesh, from.mesh().data().vertex_to_point);
    for (const gltf::Primitive& primitive : mesh.primitives)
      to.parts.push_back({primitive.first_vertex, primitive.vertex_count, primitive.material});
  }
}

}  // namespace kpsa::engine
