#include "report/character_facts.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

#include "files/quantity.h"

namespace kpsa::engine {
namespace {

FactTable::Cell Whole(std::size_t count) { return static_cast<std::uint64_t>(count); }

std::string Named(const std::string& name, const char* what, Index index) {
  return name.empty() ? fmt::format("{}{}", what, index) : name;
}

}  // namespace

FactTable TreeFacts(const gltf::Character& character) {
  FactTable tree{"tree", {"node", ">index", "mesh", "joint of"}, {}};
  const std::vector<std::string> names = character.UniqueNames();
  std::vector<std::string> joint_of(names.size());
  for (Index s = 0; s < character.skins.size(); ++s) {
    for (Index joint : character.skins[s].joints) {
      if (!joint_of[joint].empty()) joint_of[joint] += ", ";
      joint_of[joint] += Named(character.skins[s].name, "skin", s);
    }
  }
  std::vector<std::pair<Index, std::uint32_t>> open;  // nodes to come, with their depth
  for (auto n = static_cast<Index>(names.size()); n-- > 0;) {
    if (character.nodes[n].parent == kNoIndex) open.push_back({n, 0});
  }
  while (!open.empty()) {
    const auto [n, depth] = open.back();
    open.pop_back();
    const gltf::Node& node = character.nodes[n];
    for (auto child = node.children.rbegin(); child != node.children.rend(); ++child)
      open.push_back({*child, depth + 1});
    tree.depths.push_back(depth);
    tree.rows.push_back(
        {names[n], Whole(n),
         node.mesh == kNoIndex ? "" : Named(character.meshes[node.mesh].name, "mesh", node.mesh),
         joint_of[n]});
  }
  return tree;
}

FactTable MorphFacts(const gltf::Character& character) {
  FactTable morphs{"morph targets", {"mesh node", ">index", "target", ">vertices", ">weight"}, {}};
  const std::vector<std::string> names = character.UniqueNames();
  for (Index n : character.MeshNodes()) {
    const gltf::Node& node = character.nodes[n];
    const gltf::Mesh& mesh = character.meshes[node.mesh];
    const std::vector<double>& weights = node.weights.empty() ? mesh.weights : node.weights;
    for (Index t = 0; t < mesh.targets.size(); ++t) {
      morphs.rows.push_back({names[n], Whole(t), mesh.targets[t].name, Whole(mesh.targets[t].vertices.size()),
                             t < weights.size() ? weights[t] : 0.0});
    }
  }
  return morphs;
}

FactTable MaterialFacts(const gltf::Character& character) {
  FactTable materials{
      "materials used", {"material", ">index", ">primitives", ">vertices", "linear colour"}, {}};
  for (Index m = 0; m < character.materials.size(); ++m) {
    std::size_t primitives = 0, vertices = 0;
    for (Index n : character.MeshNodes()) {
      for (const gltf::Primitive& primitive : character.meshes[character.nodes[n].mesh].primitives) {
        if (primitive.material == m) ++primitives, vertices += primitive.vertex_count;
      }
    }
    const auto& c = character.materials[m].base_color;
    materials.rows.push_back({MaterialName(character, m), Whole(m), Whole(primitives), Whole(vertices),
                              fmt::format("{:.3g} {:.3g} {:.3g}", c[0], c[1], c[2])});
  }
  return materials;
}

std::uint64_t FrameCount(double seconds, double fps) {
  return static_cast<std::uint64_t>(std::floor(std::min(seconds * fps, 1e15) + 1e-3)) + 1;
}

Result<FileFacts> VerticesFacts(const Rig& rig, const std::string& name) {
  const Result<NamedVertices> found = FindVertices(rig, name);
  if (!found.ok()) return found.status();
  FileFacts facts;
  facts.kind = found->kind == NameKind::kJoint      ? "vertices of a joint"
               : found->kind == NameKind::kMaterial ? "vertices of a material"
                                                    : "vertices of a mesh";
  facts.facts = {{"name", name}};
  FactTable meshes{"meshes", {"mesh", ">count", "vertices"}, {}};
  for (const MeshVertices& one : found->meshes) {
    meshes.rows.push_back(
        {rig.scene.meshes[one.mesh].name, Whole(one.vertices.size()), RangesText(one.vertices)});
  }
  facts.tables = {std::move(meshes)};
  return facts;
}

Result<FileFacts> NearestFacts(const Rig& rig, Double3 place) {
  const Result<NearVertex> nearest = NearestVertex(rig, place);
  if (!nearest.ok()) return nearest.status();
  FileFacts facts;
  facts.kind = "nearest vertex";
  facts.facts = {{"mesh", rig.scene.meshes[nearest->mesh].name},
                 {"vertex", Whole(nearest->vertex)},
                 {"distance metres", nearest->distance}};
  for (int k = 0; k < 3; ++k) facts.facts.emplace_back(std::string(1, "xyz"[k]), nearest->at[k]);
  return facts;
}

}  // namespace kpsa::engine
