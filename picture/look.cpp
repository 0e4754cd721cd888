#include "picture/look.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "picture/decode.h"
#include "rig/character/smoothing.h"

namespace kpsa::engine {
namespace {

constexpr std::uint64_t kMostBytes = std::uint64_t{512} << 20;  // of files of images
constexpr std::uint64_t kMostPixels = std::uint64_t{256}
                                      << 20;  // of what they decode to: 1 GiB with their halves

const gltf::Mesh& FileMesh(const Rig& rig, std::size_t m) {
  return rig.character->meshes[rig.character->nodes[rig.scene.meshes[m].gltf_node].mesh];
}

// A material's texture, and how coordinates come to lie on it.
struct MaterialTexture {
  gltf::BaseTexture lies;
  SurfaceTexture surface;
};
// Of the materials that the meshes have, by material of the rig's character.
std::map<Index, MaterialTexture> ReadTextures(const Rig& rig, const std::vector<std::size_t>& meshes,
                                              std::vector<std::string>* notes) {
  std::map<std::string, std::vector<Index>> by_file;  // materials, as the rig counts them
  std::set<Index> seen;
  for (const std::size_t m : meshes) {
    for (const gltf::Primitive& primitive : FileMesh(rig, m).primitives) {
      if (primitive.material == kNoIndex || !seen.insert(primitive.material).second) continue;
      by_file[rig.character->materials[primitive.material].file].push_back(primitive.material);
    }
  }
  std::map<Index, MaterialTexture> all;
  std::uint64_t bytes = kMostBytes, pixels = kMostPixels;
  for (const auto& [file, materials] : by_file) {
    std::vector<Index> wanted;
    for (const Index material : materials) wanted.push_back(rig.character->materials[material].index);
    gltf::BaseTextures read = gltf::ReadBaseTextures(file, wanted, &bytes, notes);
    std::vector<std::shared_ptr<const Texture>> pictures;
    for (gltf::BaseTextures::Image& image : read.images) {
      Result<Image> picture = DecodePicture(image.bytes, pixels);
      image.bytes = {};
      if (picture.ok()) {
        pixels -= static_cast<std::uint64_t>(picture->width) * static_cast<std::uint64_t>(picture->height);
        pictures.push_back(std::make_shared<const Texture>(std::move(*picture)));
      } else {
        notes->push_back(fmt::format("{} {}; what it covers is drawn in its base colour", image.where,
                                     picture.status().errors().front().message));
        pictures.push_back(nullptr);
      }
    }
    for (std::size_t i = 0; i < materials.size(); ++i) {
      const std::optional<gltf::BaseTexture>& lies = read.materials[wanted[i]];
      if (!lies.has_value() || pictures[lies->image] == nullptr) continue;
      all[materials[i]] = {*lies, {pictures[lies->image], lies->wrap_u, lies->wrap_v, lies->nearest}};
    }
  }
  return all;
}

// Triangles' corners: the file's vertices, or, of flat primitives, new ones; *vertices: the file's, by corner.
void SplitCorners(const gltf::Mesh& file, const Mesh::Data& mesh, MeshLook* look,
                  std::vector<Index>* vertices) {
  const std::vector<Index> smooth = SmoothVertices(file, mesh.vertex_to_point);
  std::vector<Index> corner_of(smooth.size(), kNoIndex);
  const auto add = [&](Index vertex) {
    look->points.push_back(mesh.vertex_to_point[vertex]);
    vertices->push_back(vertex);
    return static_cast<Index>(vertices->size() - 1);
  };
  for (const Index vertex : mesh.triangle_vertices) {
    Index* const known = smooth[vertex] == kNoIndex ? nullptr : &corner_of[vertex];
    if (known == nullptr) {
      look->triangles.push_back(add(vertex));
      continue;
    }
    if (*known == kNoIndex) *known = add(vertex);
    look->triangles.push_back(*known);
  }
  // The first vertex of those that share a normal may be of no triangle
  std::vector<Index> first(smooth.size(), kNoIndex);
  for (Index c = 0; c < vertices->size(); ++c) {
    const Index share = smooth[(*vertices)[c]];
    if (share != kNoIndex && first[share] == kNoIndex) first[share] = c;
    look->smooth.push_back(share == kNoIndex ? c : first[share]);
  }
}

// COLOR_0 times the materials' colours (glTF 2.0, 3.9.2), by corner; none where all are grey.
void AddColors(const Rig& rig, std::size_t m, const std::vector<Index>& vertices, bool textured,
               MeshLook* look) {
  const gltf::Mesh& file = FileMesh(rig, m);
  const Mesh::Data& mesh = rig.scene.meshes[m].mesh().data();
  const bool colored =
      textured || !file.colors.empty() ||
      std::any_of(mesh.primitives.begin(), mesh.primitives.end(), [](const Mesh::Primitive& p) {
        return p.base_color[0] != p.base_color[1] || p.base_color[1] != p.base_color[2];
      });
  if (!colored) return;
  std::vector<float> by_vertex(3 * file.vertex_count(), 1.0f);
  for (std::size_t p = 0; p < mesh.primitives.size(); ++p) {
    const Mesh::Primitive& primitive = mesh.primitives[p];
    const bool plain = file.primitives[p].material == kNoIndex && !file.colors.empty();
    for (std::size_t i = 3 * std::size_t{primitive.first_vertex};
         i < 3 * (std::size_t{primitive.first_vertex} + primitive.vertex_count); ++i) {
      by_vertex[i] = (plain ? 1 : primitive.base_color[i % 3]) * (file.colors.empty() ? 1 : file.colors[i]);
    }
  }
  look->colors.reserve(3 * vertices.size());
  for (const Index vertex : vertices) {
    const auto from = by_vertex.begin() + std::ptrdiff_t{3} * vertex;
    look->colors.insert(look->colors.end(), from, from + 3);
  }
}

// Texture coordinates by corner, where they lie on their pictures.
void AddTextures(const gltf::Mesh& file, const std::map<Index, MaterialTexture>& all,
                 const std::vector<Index>& vertices, const std::string& mesh, MeshLook* look,
                 std::vector<std::string>* notes) {
  std::vector<Index> by_vertex(file.vertex_count(), kNoIndex);
  std::vector<float> placed(2 * file.vertex_count(), 0.0f);
  for (std::size_t p = 0; p < file.primitives.size(); ++p) {
    const gltf::Primitive& primitive = file.primitives[p];
    const auto found = all.find(primitive.material);
    if (found == all.end()) continue;
    const gltf::BaseTexture& lies = found->second.lies;
    const std::vector<float>& uvs = file.UvSet(lies.uv_set);
    const std::size_t first = 2 * std::size_t{primitive.first_vertex}, count = primitive.vertex_count;
    if (uvs.empty() || (count > 0 && !std::isfinite(uvs[first]))) {
      notes->push_back(
          fmt::format("primitive {} of mesh \"{}\" has no TEXCOORD_{} for its texture; it is drawn "
                      "in its base colour",
                      p, mesh, lies.uv_set));
      continue;
    }
    for (std::size_t i = first; i < first + 2 * count; i += 2) {
      const auto& [a, b, c, d, e, f] = lies.place;
      placed[i] = static_cast<float>(a * uvs[i] + b * uvs[i + 1] + c);
      placed[i + 1] = static_cast<float>(d * uvs[i] + e * uvs[i + 1] + f);
      by_vertex[i / 2] = static_cast<Index>(look->textures.size());
    }
    look->textures.push_back(found->second.surface);
  }
  if (look->textures.empty()) return;
  for (const Index vertex : vertices) {
    look->texture.push_back(by_vertex[vertex]);
    look->uvs.push_back(placed[2 * std::size_t{vertex}]);
    look->uvs.push_back(placed[2 * std::size_t{vertex} + 1]);
  }
}

}  // namespace

RigLook LookOf(const Rig& rig, const std::vector<std::size_t>& meshes, bool textures,
               std::vector<std::string>* notes) {
  std::map<Index, MaterialTexture> all;
  if (textures) all = ReadTextures(rig, meshes, notes);
  RigLook looks(rig.scene.meshes.size());
  for (const std::size_t m : meshes) {
    MeshLook& look = looks[m];
    std::vector<Index> vertices;
    SplitCorners(FileMesh(rig, m), rig.scene.meshes[m].mesh().data(), &look, &vertices);
    if (!all.empty()) AddTextures(FileMesh(rig, m), all, vertices, rig.scene.meshes[m].name, &look, notes);
    AddColors(rig, m, vertices, !look.textures.empty(), &look);
  }
  return looks;
}

}  // namespace kpsa::engine
