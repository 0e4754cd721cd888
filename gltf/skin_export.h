// Meshes of a cache that glTF moves itself: nodes, skins and morph targets in a .glb. Nothing outside gltf/ includes
// this.
#pragma once

#include <span>
#include <vector>

#include "files/point_cache.h"
#include "gltf/glb_file.h"
#include "gltf/node_tracks.h"
#include "gltf/skinned_scene.h"

namespace kpsa::engine {

// The part's rows of what has `width` numbers a vertex.
std::span<const float> PartRows(const std::vector<float>& values, const CachePart& part, std::size_t width);
// What all primitives have: positions, normals where there are triangles, and how the part looks.
GlbPrimitive PrimitiveOfPart(const PointCacheMesh& mesh, const CachePart& part,
                             const std::vector<float>& rest, const std::vector<float>& normals, GlbFile* glb);

class SkinExport {
 public:
  // Refers to its arguments. `times`: the accessor of the keys, -1 for a single frame.
  SkinExport(const SkinnedScene& scene, const std::vector<NodeTrack>& tracks, int times, GlbFile* glb)
      : scene_(scene), tracks_(tracks), times_(times), glb_(glb) {}

  // The nodes that move these meshes of the cache, and those above. Where joints have no common root, one is put above
  // all of them, as skins want it.
  void AddNodes(const std::vector<const CacheSkin*>& skins);
  // A mesh of those: its node, skin, targets and weights. `mesh` says how it looks.
  void AddMesh(const PointCacheMesh& mesh, const CacheSkin& skin);

 private:
  void AddNode(Index node, std::size_t root);
  GlbPrimitive Primitive(const PointCacheMesh& mesh, const CachePart& part, const CacheSkin& skin,
                         const std::vector<float>& normals,
                         const std::vector<CacheTarget>& target_normals) const;
  std::size_t SkinOf(const CacheSkin& skin);
  // For a mesh with joints: its own node, where joints hang from that and it stays at the origin; else a new one.
  std::size_t NodeForSkin(const std::string& name);

  const SkinnedScene& scene_;
  const std::vector<NodeTrack>& tracks_;
  const int times_;
  GlbFile* glb_;
  bool rooted_ = false;                  // a node of ours is above the joints
  std::vector<std::size_t> written_;     // by node of the scene: its place in the file, kNowhere: not in it
  std::vector<const CacheSkin*> skins_;  // in the file's order
};

}  // namespace kpsa::engine
