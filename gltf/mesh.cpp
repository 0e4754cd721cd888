#include <fmt/format.h>
#include <tiny_gltf.h>

#include <algorithm>
#include <charconv>
#include <map>

#include "gltf/document.h"
#include "gltf/vertex_look.h"

namespace kpsa::engine::gltf {
namespace {

constexpr float kNegativeNoise = -1e-4f;  // exporters' rounding; such weights count as zero

// The list of vertices, as drawn, to triangles (glTF 2.0, 3.7.2.1); an incomplete last triangle is not drawn.
// `at(i)` is the vertex of place i of `count`.
template <typename At>
void Unroll(int mode, std::size_t count, const At& at, std::vector<Index>* triangles) {
  const auto add = [&](std::size_t a, std::size_t b, std::size_t c) {
    triangles->insert(triangles->end(), {at(a), at(b), at(c)});
  };
  if (mode == TINYGLTF_MODE_TRIANGLES) {
    for (std::size_t i = 0; i + 2 < count; i += 3) add(i, i + 1, i + 2);
  } else if (mode == TINYGLTF_MODE_TRIANGLE_STRIP) {
    for (std::size_t i = 0; i + 2 < count; ++i) add(i, i + 1 + i % 2, i + 2 - i % 2);
  } else if (mode == TINYGLTF_MODE_TRIANGLE_FAN) {
    for (std::size_t i = 0; i + 2 < count; ++i) add(i + 1, i + 2, 0);
  }
}

Status ReadTriangles(const Document& document, const tinygltf::Primitive& in, const std::string& where,
                     Primitive* out) {
  if (in.mode < 0 || in.mode > TINYGLTF_MODE_TRIANGLE_FAN) {
    return Status::Invalid("{}.mode is {}, expected 0 to 6", where, in.mode);
  }
  if (in.mode < TINYGLTF_MODE_TRIANGLES || out->vertex_count == 0) return {};
  const std::size_t factor = in.mode == TINYGLTF_MODE_TRIANGLES ? 1 : 3;
  const Index first = out->first_vertex;
  if (in.indices < 0) {
    KPSA_RETURN_IF_ERROR(document.budget.TakeMemory(4 * factor * out->vertex_count, where));
    Unroll(
        in.mode, out->vertex_count, [&](std::size_t i) { return first + static_cast<Index>(i); },
        &out->triangles);
    return {};
  }
  std::vector<Index> indices;
  const std::string what = where + ".indices";
  KPSA_RETURN_IF_ERROR(
      ReadIndices(document, in.indices, 1, kUnsignedByte | kUnsignedShort | kUnsignedInt, what, &indices));
  for (std::size_t i = 0; i < indices.size(); ++i) {
    if (indices[i] >= out->vertex_count) {
      return Status::Invalid("{}: index {} is {}, the primitive has {} vertices", what, i, indices[i],
                             out->vertex_count);
    }
  }
  KPSA_RETURN_IF_ERROR(document.budget.TakeMemory(4 * factor * indices.size(), what));
  Unroll(
      in.mode, indices.size(), [&](std::size_t i) { return first + indices[i]; }, &out->triangles);
  return {};
}

// The n of all attributes <prefix>n, ascending. "-0" and "00" are no numbers of sets.
std::vector<int> AttributeSets(const std::map<std::string, int>& attributes, std::string_view prefix) {
  std::vector<int> sets;
  for (const auto& [name, accessor] : attributes) {
    if (!name.starts_with(prefix)) continue;
    int n = 0;
    const char* end = name.data() + name.size();
    const auto [stop, error] = std::from_chars(name.data() + prefix.size(), end, n);
    if (error == std::errc() && stop == end && n >= 0 && name == fmt::format("{}{}", prefix, n))
      sets.push_back(n);
  }
  std::sort(sets.begin(), sets.end());
  return sets;
}

// Appends the rows of this primitive; offsets holds one entry for each vertex before it, and the first 0.
Status ReadInfluences(const Document& document, const tinygltf::Primitive& in, const std::string& where,
                      Primitive* primitive, Mesh* mesh) {
  const std::vector<int> sets = AttributeSets(in.attributes, "JOINTS_");
  if (sets != AttributeSets(in.attributes, "WEIGHTS_")) {
    return Status::Invalid("{} must have a WEIGHTS_n for each JOINTS_n", where);
  }
  if (sets.empty() || primitive->vertex_count == 0) {
    mesh->influence_offsets.insert(mesh->influence_offsets.end(), primitive->vertex_count,
                                   static_cast<Index>(mesh->influences.size()));
    return {};
  }
  primitive->skinned = true;
  std::vector<std::vector<Index>> joints(sets.size());
  std::vector<std::vector<float>> weights(sets.size());
  for (std::size_t s = 0; s < sets.size(); ++s) {
    const std::string joints_name = fmt::format("JOINTS_{}", sets[s]),
                      weights_name = fmt::format("WEIGHTS_{}", sets[s]);
    const int joint_accessor = FindAttribute(in.attributes, joints_name);
    const int weight_accessor = FindAttribute(in.attributes, weights_name);
    const std::string joint_place = where + "." + joints_name, weight_place = where + "." + weights_name;
    KPSA_RETURN_IF_ERROR(CheckCount(document, joint_accessor, primitive->vertex_count, joint_place));
    KPSA_RETURN_IF_ERROR(CheckCount(document, weight_accessor, primitive->vertex_count, weight_place));
    KPSA_RETURN_IF_ERROR(
        ReadIndices(document, joint_accessor, 4, kUnsignedByte | kUnsignedShort, joint_place, &joints[s]));
    KPSA_RETURN_IF_ERROR(ReadNumbers(document, weight_accessor, 4, kFloat | kUnsignedByte | kUnsignedShort,
                                     weight_place, &weights[s]));
  }
  std::vector<std::pair<Index, double>> row;
  for (std::size_t v = 0; v < primitive->vertex_count; ++v) {
    row.clear();
    double sum = 0;
    for (std::size_t s = 0; s < sets.size(); ++s) {
      for (std::size_t k = 4 * v; k < 4 * v + 4; ++k) {
        const float weight = weights[s][k];
        if (weight < kNegativeNoise) {
          return Status::Invalid("{}.WEIGHTS_{}: vertex {} has the negative weight {}", where, sets[s], v,
                                 weight);
        }
        if (weight <= 0) continue;
        sum += weight;
        const auto same =
            std::find_if(row.begin(), row.end(), [&](const auto& r) { return r.first == joints[s][k]; });
        if (same != row.end()) {
          same->second += weight;
        } else {
          row.emplace_back(joints[s][k], weight);
        }
      }
    }
    if (row.empty()) {
      row.emplace_back(joints[0][4 * v], 1.0);
      sum = 1;
    }
    KPSA_RETURN_IF_ERROR(document.budget.TakeMemory(4 + 8 * row.size(), where));
    for (const auto& [joint, weight] : row)
      mesh->influences.push_back({joint, static_cast<float>(weight / sum)});
    mesh->influence_offsets.push_back(static_cast<Index>(mesh->influences.size()));
  }
  if (mesh->influences.size() >= kNoIndex) return Status::Invalid("{} has too many influences", where);
  return {};
}

Status ReadTargets(const Document& document, const tinygltf::Primitive& in, const std::string& where,
                   const Primitive& primitive, Mesh* mesh) {
  if (in.targets.size() != mesh->targets.size()) {
    return Status::Invalid("{} has {} morph targets, primitives[0] has {}; all primitives must have the same",
                           where, in.targets.size(), mesh->targets.size());
  }
  for (std::size_t t = 0; t < in.targets.size(); ++t) {
    const int accessor = FindAttribute(in.targets[t], "POSITION");
    if (accessor < 0 || primitive.vertex_count == 0) continue;
    const std::string what = fmt::format("{}.targets[{}].POSITION", where, t);
    KPSA_RETURN_IF_ERROR(CheckCount(document, accessor, primitive.vertex_count, what));
    std::vector<Index> vertices;
    std::vector<float> deltas;
    KPSA_RETURN_IF_ERROR(ReadSparseVectors(document, accessor, kPositionTypes, what, &vertices, &deltas));
    for (Index& vertex : vertices) vertex += primitive.first_vertex;
    MorphTarget& target = mesh->targets[t];
    target.vertices.insert(target.vertices.end(), vertices.begin(), vertices.end());
    target.deltas.insert(target.deltas.end(), deltas.begin(), deltas.end());
  }
  return {};
}

Status ReadPrimitive(const Document& document, const tinygltf::Primitive& in, const std::string& where,
                     Mesh* mesh) {
  Primitive primitive;
  primitive.first_vertex = static_cast<Index>(mesh->vertex_count());
  primitive.material = in.material < 0 ? kNoIndex : static_cast<Index>(in.material);
  if (const int accessor = FindAttribute(in.attributes, "POSITION"); accessor >= 0) {
    std::vector<float> positions;
    KPSA_RETURN_IF_ERROR(ReadNumbers(document, accessor, 3, kPositionTypes, where + ".POSITION", &positions));
    if (mesh->vertex_count() + positions.size() / 3 >= kNoIndex) {
      return Status::Invalid("{}: the mesh has more than {} vertices", where, kNoIndex - 1);
    }
    primitive.vertex_count = static_cast<Index>(positions.size() / 3);
    mesh->positions.insert(mesh->positions.end(), positions.begin(), positions.end());
  }
  KPSA_RETURN_IF_ERROR(ReadTriangles(document, in, where, &primitive));
  KPSA_RETURN_IF_ERROR(ReadInfluences(document, in, where, &primitive, mesh));
  KPSA_RETURN_IF_ERROR(ReadTargets(document, in, where, primitive, mesh));
  KPSA_RETURN_IF_ERROR(ReadVertexLook(document, in, where, primitive, mesh));
  mesh->primitives.push_back(std::move(primitive));
  return {};
}

Status ReadMesh(const Document& document, std::size_t index, Mesh* mesh) {
  const tinygltf::Mesh& in = document.model->meshes[index];
  mesh->name = in.name;
  mesh->targets.resize(in.primitives.empty() ? 0 : in.primitives[0].targets.size());
  const std::vector<std::string>& names = document.target_names[index];
  for (std::size_t t = 0; t < std::min(names.size(), mesh->targets.size()); ++t)
    mesh->targets[t].name = names[t];
  mesh->influence_offsets = {0};
  for (std::size_t p = 0; p < in.primitives.size(); ++p) {
    KPSA_RETURN_IF_ERROR(
        ReadPrimitive(document, in.primitives[p], fmt::format("meshes[{}].primitives[{}]", index, p), mesh));
  }
  if (std::none_of(mesh->primitives.begin(), mesh->primitives.end(),
                   [](const Primitive& p) { return p.skinned; })) {
    mesh->influence_offsets.clear();
  }
  if (!in.weights.empty() && in.weights.size() != mesh->targets.size()) {
    return Status::Invalid("meshes[{}].weights has {} numbers for {} morph targets", index, in.weights.size(),
                           mesh->targets.size());
  }
  mesh->weights = in.weights;
  mesh->weights.resize(mesh->targets.size(), 0.0);
  return {};
}

}  // namespace

Status ReadMeshes(const Document& document, Character* character) {
  const tinygltf::Model& model = *document.model;
  character->meshes.resize(model.meshes.size());
  for (std::size_t i = 0; i < model.meshes.size(); ++i) {
    KPSA_RETURN_IF_ERROR(ReadMesh(document, i, &character->meshes[i]));
  }
  for (const tinygltf::Material& in : model.materials) {
    Material& material = character->materials.emplace_back();
    material.name = in.name;
    const std::vector<double>& color = in.pbrMetallicRoughness.baseColorFactor;
    for (std::size_t i = 0; i < 4 && color.size() == 4; ++i) material.base_color[i] = color[i];
  }
  return {};
}

}  // namespace kpsa::engine::gltf
