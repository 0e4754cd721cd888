#include <fmt/format.h>
#include <tiny_gltf.h>

#include <algorithm>
#include <unordered_map>

#include "base/matrix.h"
#include "gltf/document.h"

namespace kpsa::engine::gltf {
namespace {

Index ToIndex(int index) { return index < 0 ? kNoIndex : static_cast<Index>(index); }

void ReadTransform(const tinygltf::Node& in, Node* node) {
  node->has_matrix = in.matrix.size() == 16;
  if (node->has_matrix) std::copy(in.matrix.begin(), in.matrix.end(), node->matrix.m.begin());
  if (in.translation.size() == 3)
    node->translation = {in.translation[0], in.translation[1], in.translation[2]};
  if (in.rotation.size() == 4)
    node->rotation = {in.rotation[0], in.rotation[1], in.rotation[2], in.rotation[3]};
  if (in.scale.size() == 3) node->scale = {in.scale[0], in.scale[1], in.scale[2]};
}

// Parents, and the order in which parents come first. Hierarchies may be 100,000 deep: no recursion.
Status LinkHierarchy(Character* character) {
  std::vector<Node>& nodes = character->nodes;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    for (const Index child : nodes[i].children) {
      if (nodes[child].parent != kNoIndex) {
        return Status::Invalid("nodes[{}] is a child of nodes[{}] and of nodes[{}]; a node has one parent",
                               child, nodes[child].parent, i);
      }
      nodes[child].parent = static_cast<Index>(i);
    }
  }
  std::vector<Index>& order = character->order;
  order.reserve(nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (nodes[i].parent == kNoIndex) order.push_back(static_cast<Index>(i));
  }
  for (std::size_t i = 0; i < order.size(); ++i) {
    const Node& node = nodes[order[i]];
    order.insert(order.end(), node.children.begin(), node.children.end());
  }
  if (order.size() == nodes.size()) return {};

  // Every node has at most one parent, so what no root reaches is on, or below, a cycle: walk up until one
  // repeats
  std::vector<bool> seen(nodes.size(), false);
  for (const Index node : order) seen[node] = true;
  Index at = static_cast<Index>(std::find(seen.begin(), seen.end(), false) - seen.begin());
  while (!seen[at]) {
    seen[at] = true;
    at = nodes[at].parent;
  }
  return Status::Invalid("nodes[{}] is its own ancestor; the hierarchy has a cycle", at);
}

void MarkScene(const Document& document, Character* character) {
  const tinygltf::Model& model = *document.model;
  std::vector<Index>& roots = character->scene_roots;
  if (model.scenes.empty()) {
    for (std::size_t i = 0; i < character->nodes.size(); ++i) {
      if (character->nodes[i].parent == kNoIndex) roots.push_back(static_cast<Index>(i));
    }
  } else {
    const std::size_t scene = model.defaultScene < 0 ? 0 : static_cast<std::size_t>(model.defaultScene);
    for (const int node : model.scenes[scene].nodes) roots.push_back(static_cast<Index>(node));
  }
  for (const Index root : roots) character->nodes[root].in_scene = true;
  for (const std::size_t hidden : document.hidden) character->nodes[hidden].visible = false;
  for (const Index node : character->order) {
    const Index parent = character->nodes[node].parent;
    if (parent == kNoIndex) continue;
    if (character->nodes[parent].in_scene) character->nodes[node].in_scene = true;
    if (!character->nodes[parent].visible) character->nodes[node].visible = false;
  }
}

// A mesh's joint numbers must exist in every skin that it is shown with.
Status CheckJoints(const Character& character) {
  std::vector<Index> joint_count(character.meshes.size(), 0), vertex(character.meshes.size(), 0);
  for (std::size_t m = 0; m < character.meshes.size(); ++m) {
    const CsrView<Influence> rows = character.meshes[m].influence_rows();
    for (std::size_t v = 0; v < rows.rows(); ++v) {
      for (const Influence& influence : rows.row(v)) {
        if (influence.joint < joint_count[m]) continue;
        joint_count[m] = influence.joint + 1;
        vertex[m] = static_cast<Index>(v);
      }
    }
  }
  for (std::size_t i = 0; i < character.nodes.size(); ++i) {
    const Node& node = character.nodes[i];
    if (node.skin == kNoIndex || joint_count[node.mesh] <= character.skins[node.skin].joints.size()) continue;
    return Status::Invalid("meshes[{}]: vertex {} follows joint {}, but skins[{}] of nodes[{}] has {} joints",
                           node.mesh, vertex[node.mesh], joint_count[node.mesh] - 1, node.skin, i,
                           character.skins[node.skin].joints.size());
  }
  return {};
}

std::string NodeName(const Character& character, std::size_t node) {
  return character.nodes[node].name.empty() ? fmt::format("node{}", node) : character.nodes[node].name;
}

}  // namespace

Matrix4 Node::LocalMatrix() const { return has_matrix ? matrix : ComposeTrs(translation, rotation, scale); }

Status ReadScene(const Document& document, Character* character) {
  const tinygltf::Model& model = *document.model;
  character->nodes.resize(model.nodes.size());
  for (std::size_t i = 0; i < model.nodes.size(); ++i) {
    const tinygltf::Node& in = model.nodes[i];
    Node& node = character->nodes[i];
    node.name = in.name;
    for (const int child : in.children) node.children.push_back(static_cast<Index>(child));
    ReadTransform(in, &node);
    node.mesh = ToIndex(in.mesh);
    if (node.mesh == kNoIndex) continue;
    node.skin = ToIndex(in.skin);
    const std::size_t targets = character->meshes[node.mesh].targets.size();
    if (!in.weights.empty() && in.weights.size() != targets) {
      return Status::Invalid("nodes[{}].weights has {} numbers for the {} morph targets of meshes[{}]", i,
                             in.weights.size(), targets, node.mesh);
    }
    node.weights = in.weights;
  }
  KPSA_RETURN_IF_ERROR(LinkHierarchy(character));
  MarkScene(document, character);
  return {};
}

Status ReadSkins(const Document& document, Character* character) {
  const tinygltf::Model& model = *document.model;
  for (std::size_t s = 0; s < model.skins.size(); ++s) {
    const tinygltf::Skin& in = model.skins[s];
    Skin& skin = character->skins.emplace_back();
    skin.name = in.name;
    skin.skeleton = ToIndex(in.skeleton);
    for (const int joint : in.joints) skin.joints.push_back(static_cast<Index>(joint));
    skin.inverse_bind_matrices.resize(skin.joints.size());
    if (in.inverseBindMatrices < 0) continue;
    const std::string what = fmt::format("skins[{}].inverseBindMatrices", s);
    std::vector<double> numbers;
    KPSA_RETURN_IF_ERROR(ReadNumbers(document, in.inverseBindMatrices, 16, kFloat, what, &numbers));
    if (numbers.size() < 16 * skin.joints.size()) {
      return Status::Invalid("{} has {} matrices for {} joints", what, numbers.size() / 16,
                             skin.joints.size());
    }
    for (std::size_t j = 0; j < skin.joints.size(); ++j) {
      std::copy_n(numbers.begin() + static_cast<std::ptrdiff_t>(16 * j), 16,
                  skin.inverse_bind_matrices[j].m.begin());
    }
  }
  return CheckJoints(*character);
}

std::vector<std::string> Character::UniqueNames() const {
  std::unordered_map<std::string, int> among_all, among_meshes;
  std::vector<std::string> names(nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    names[i] = NodeName(*this, i);
    ++among_all[names[i]];
    if (nodes[i].mesh != kNoIndex) ++among_meshes[names[i]];
  }
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const bool shared = (nodes[i].mesh != kNoIndex ? among_meshes : among_all)[names[i]] > 1;
    if (shared) names[i] += fmt::format("#{}", i);
  }
  return names;
}

std::string Character::UniqueName(Index node) const {
  const std::string name = NodeName(*this, node);
  const bool is_mesh = nodes[node].mesh != kNoIndex;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (i != node && (!is_mesh || nodes[i].mesh != kNoIndex) && NodeName(*this, i) == name) {
      return fmt::format("{}#{}", name, node);
    }
  }
  return name;
}

Index Character::FindClip(std::string_view id) const {
  for (std::size_t i = 0; i < clips.size(); ++i) {
    if (clips[i].id == id) return static_cast<Index>(i);
  }
  return kNoIndex;
}

std::vector<Index> Character::MeshNodes() const {
  std::vector<Index> result;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (nodes[i].in_scene && nodes[i].mesh != kNoIndex) result.push_back(static_cast<Index>(i));
  }
  return result;
}

}  // namespace kpsa::engine::gltf
