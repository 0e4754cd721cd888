#include "gltf/vertex_look.h"

#include <fmt/format.h>
#include <tiny_gltf.h>

#include <algorithm>
#include <limits>

namespace kpsa::engine::gltf {
namespace {

constexpr float kNoNumber = std::numeric_limits<float>::quiet_NaN();

// Appends the colours of this primitive where it has them, white else; nothing while no primitive had any.
Status ReadColors(const Document& document, const tinygltf::Primitive& in, const std::string& where,
                  const Primitive& primitive, Mesh* mesh) {
  const int accessor = FindAttribute(in.attributes, "COLOR_0");
  if (accessor < 0 && mesh->colors.empty()) return {};
  KPSA_RETURN_IF_ERROR(
      document.budget.TakeMemory(12 * (mesh->vertex_count() - mesh->colors.size() / 3), where));
  if (accessor >= 0) {
    const std::string place = where + ".COLOR_0";
    KPSA_RETURN_IF_ERROR(CheckCount(document, accessor, primitive.vertex_count, place));
    const bool with_alpha =
        document.model->accessors[static_cast<std::size_t>(accessor)].type == TINYGLTF_TYPE_VEC4;
    const std::size_t components = with_alpha ? 4 : 3;
    std::vector<float> colors;
    KPSA_RETURN_IF_ERROR(ReadNumbers(document, accessor, static_cast<int>(components),
                                     kFloat | kUnsignedByte | kUnsignedShort, place, &colors));
    mesh->colors.resize(3 * static_cast<std::size_t>(primitive.first_vertex), 1.0f);
    for (std::size_t i = 0; i < colors.size(); ++i) {
      if (i % components < 3) mesh->colors.push_back(std::clamp(colors[i], 0.0f, 1.0f));
    }
  }
  mesh->colors.resize(mesh->positions.size(), 1.0f);
  return {};
}

// Appends the texture coordinates of this primitive where it has them; nothing while no primitive had any.
Status ReadUvs(const Document& document, const tinygltf::Primitive& in, const std::string& where, int set,
               const Primitive& primitive, const Mesh& mesh, std::vector<float>* all) {
  const std::string name = fmt::format("TEXCOORD_{}", set);
  const int accessor = FindAttribute(in.attributes, name);
  if (accessor < 0 && all->empty()) return {};
  KPSA_RETURN_IF_ERROR(document.budget.TakeMemory(8 * (mesh.vertex_count() - all->size() / 2), where));
  if (accessor >= 0 && primitive.vertex_count > 0) {
    const std::string place = where + "." + name;
    KPSA_RETURN_IF_ERROR(CheckCount(document, accessor, primitive.vertex_count, place));
    std::vector<float> uvs;
    KPSA_RETURN_IF_ERROR(ReadNumbers(document, accessor, 2, kPositionTypes, place, &uvs));
    all->resize(2 * static_cast<std::size_t>(primitive.first_vertex), kNoNumber);
    all->insert(all->end(), uvs.begin(), uvs.end());
  }
  all->resize(2 * mesh.vertex_count(), kNoNumber);
  return {};
}

// Likewise the normals.
Status ReadNormals(const Document& document, const tinygltf::Primitive& in, const std::string& where,
                   const Primitive& primitive, Mesh* mesh) {
  const int accessor = FindAttribute(in.attributes, "NORMAL");
  if (accessor < 0 && mesh->normals.empty()) return {};
  KPSA_RETURN_IF_ERROR(
      document.budget.TakeMemory(12 * (mesh->vertex_count() - mesh->normals.size() / 3), where));
  if (accessor >= 0 && primitive.vertex_count > 0) {
    const std::string place = where + ".NORMAL";
    KPSA_RETURN_IF_ERROR(CheckCount(document, accessor, primitive.vertex_count, place));
    std::vector<float> normals;
    KPSA_RETURN_IF_ERROR(ReadDirections(document, accessor, kFloat | kByte | kShort, place, &normals));
    mesh->normals.resize(3 * static_cast<std::size_t>(primitive.first_vertex), kNoNumber);
    mesh->normals.insert(mesh->normals.end(), normals.begin(), normals.end());
  }
  mesh->normals.resize(mesh->positions.size(), kNoNumber);
  return {};
}

}  // namespace

int FindAttribute(const std::map<std::string, int>& attributes, const std::string& name) {
  const auto found = attributes.find(name);
  return found == attributes.end() ? -1 : found->second;
}

Status CheckCount(const Document& document, int accessor, std::size_t expected, const std::string& what) {
  if (accessor < 0) return Status::Invalid("{} is missing", what);
  const std::size_t count = AccessorCount(document, accessor);
  if (count == expected) return {};
  return Status::Invalid("{} (accessors[{}]) has {} elements, POSITION has {}", what, accessor, count,
                         expected);
}

const std::vector<float>& Mesh::UvSet(std::size_t n) const {
  static const std::vector<float> none;
  return n == 0 ? uvs : n <= more_uvs.size() ? more_uvs[n - 1] : none;
}

Status ReadVertexLook(const Document& document, const tinygltf::Primitive& in, const std::string& where,
                      const Primitive& primitive, Mesh* mesh) {
  KPSA_RETURN_IF_ERROR(ReadColors(document, in, where, primitive, mesh));
  KPSA_RETURN_IF_ERROR(ReadUvs(document, in, where, 0, primitive, *mesh, &mesh->uvs));
  for (std::size_t set = 1; set <= mesh->more_uvs.size(); ++set) {
    KPSA_RETURN_IF_ERROR(
        ReadUvs(document, in, where, static_cast<int>(set), primitive, *mesh, &mesh->more_uvs[set - 1]));
  }
  return ReadNormals(document, in, where, primitive, mesh);
}

}  // namespace kpsa::engine::gltf
