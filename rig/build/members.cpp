#include "rig/build/members.h"

#include <algorithm>

#include "rig/build/vertices.h"

namespace kpsa::engine {

// Whether another mesh of the deformer has what this one lacks: then this one has no such members, and nobody
// erred.
bool Members::AnyOther(const MadeNode& made, const DeformedGeometry& of,
                       const std::function<bool(const CharacterMesh&)>& has) const {
  return std::any_of(made.geometries.begin(), made.geometries.end(), [&](const DeformedGeometry& other) {
    return &other != &of && other.mesh.has_value() && has(in_.rig.scene.meshes[*other.mesh]);
  });
}

bool Members::Add(const YamlNode& node, int source, const MadeNode& made, const DeformedGeometry& of,
                  std::vector<float>* weights) const {
  if (node.is_scalar() && node.scalar == "all") {
    std::fill(weights->begin(), weights->end(), 1.0f);
    return true;
  }
  if (node.is_sequence()) {
    bool good = true;
    for (const YamlNode& item : node.items) good = Add(item, source, made, of, weights) && good;
    return good;
  }
  if (!node.is_map() || node.keys.empty()) {
    return in_.errors->Add(node,
                           "members: expected all, {{vertices: \"0:99\"}}, {{primitive: 1}}, {{material: "
                           "NAME}}, {{joint: NAME, above: 0}}, "
                           "{{weights: \"file.json#map\"}} or a list of them");
  }
  YamlMap map(node, "members", in_.errors);
  const YamlNode* vertices = map.Find("vertices");
  const YamlNode* primitive = map.Find("primitive");
  const YamlNode* material = map.Find("material");
  const YamlNode* joint = map.Find("joint");
  const YamlNode* above = map.Find("above");
  const YamlNode* file_map = map.Find("weights");
  map.RejectUnread();
  if ((vertices != nullptr) + (primitive != nullptr) + (material != nullptr) + (joint != nullptr) +
              (file_map != nullptr) !=
          1 ||
      (above != nullptr && joint == nullptr)) {
    return in_.errors->Add(
        node, "members: expected one of vertices, primitive, material, joint (with above) or weights");
  }
  if (vertices != nullptr) {
    std::vector<Index> list;
    if (!ReadVertices(*vertices, VertexCount(in_.rig.scene, of), of.name, &list, in_.errors)) return false;
    for (Index v : list) (*weights)[PointOf(in_.rig.scene, of, v)] = 1;
    return true;
  }
  if (file_map != nullptr) return AddOfFile(*file_map, source, made, of, weights);
  if (!of.mesh.has_value())
    return in_.errors->Add(node, "members: {} is no mesh: only vertices and weights name its points",
                           of.name);
  if (joint != nullptr) return AddOfJoint(*joint, above, made, of, weights);
  return AddOfPrimitives(primitive, material, made, of, weights);
}

bool Members::AddOfFile(const YamlNode& reference, int source, const MadeNode& made,
                        const DeformedGeometry& of, std::vector<float>* weights) const {
  const WeightFile* file = nullptr;
  const NamedWeights* values = nullptr;
  const DeformedGeometry* owner = nullptr;
  if (!maps_->FindMap(reference, "weights", source, made, &file, &values, &owner)) return false;
  if (owner->name != of.name) return true;
  const std::vector<float> dense = DenseWeights(*file, *values);
  for (Index v = 0; v < dense.size(); ++v) {
    if (dense[v] > 0) (*weights)[PointOf(in_.rig.scene, of, v)] = 1;
  }
  return true;
}

bool Members::AddOfJoint(const YamlNode& joint, const YamlNode* above, const MadeNode& made,
                         const DeformedGeometry& of, std::vector<float>* weights) const {
  const CharacterMesh& mesh = in_.rig.scene.meshes[*of.mesh];
  std::string name;
  double threshold = 0;
  if (!ReadString(joint, "joint", &name, in_.errors)) return false;
  if (above != nullptr && !ReadNumber(*above, "above", Unit::kNone, FileUnits(), &threshold, in_.errors))
    return false;
  const std::optional<NodeId> node_id = in_.names.FindTransform(name, joint.where());
  if (!node_id.has_value()) return false;
  const auto it = std::find(mesh.influence_nodes.begin(), mesh.influence_nodes.end(), *node_id);
  const auto is_joint = [&](const CharacterMesh& other) {
    return std::find(other.influence_nodes.begin(), other.influence_nodes.end(), *node_id) !=
           other.influence_nodes.end();
  };
  if (it == mesh.influence_nodes.end() && AnyOther(made, of, is_joint)) return true;
  if (it == mesh.influence_nodes.end())
    return in_.errors->Add(joint, "\"{}\" is no joint of the skin of {}", name, of.name);
  const auto j = static_cast<Index>(it - mesh.influence_nodes.begin());
  for (std::size_t p = 0; p < weights->size(); ++p) {
    for (Index i = mesh.influences->offsets()[p]; i < mesh.influences->offsets()[p + 1]; ++i) {
      if (mesh.influences->joints()[i] == j && mesh.influences->weights()[i] > threshold) (*weights)[p] = 1;
    }
  }
  return true;
}

bool Members::AddOfPrimitives(const YamlNode* primitive, const YamlNode* material, const MadeNode& made,
                              const DeformedGeometry& of, std::vector<float>* weights) const {
  const auto& primitives = in_.rig.scene.meshes[*of.mesh].mesh().data().primitives;
  std::int64_t number = 0;
  std::string name;
  std::int64_t most = static_cast<std::int64_t>(primitives.size());
  AnyOther(made, of, [&](const CharacterMesh& other) {
    most = std::max(most, static_cast<std::int64_t>(other.mesh().data().primitives.size()));
    return false;
  });
  if (primitive != nullptr && !ReadInteger(*primitive, "primitive", 0, most - 1, &number, in_.errors))
    return false;
  if (material != nullptr && !ReadString(*material, "material", &name, in_.errors)) return false;
  bool found = false;
  std::vector<std::string> names;
  for (std::size_t i = 0; i < primitives.size(); ++i) {
    names.push_back(primitives[i].material);
    if (primitive != nullptr ? static_cast<std::int64_t>(i) != number : primitives[i].material != name)
      continue;
    found = true;
    for (Index v = 0; v < primitives[i].vertex_count; ++v)
      (*weights)[PointOf(in_.rig.scene, of, primitives[i].first_vertex + v)] = 1;
  }
  const auto has_material = [&](const CharacterMesh& other) {
    const auto& theirs = other.mesh().data().primitives;
    return std::any_of(theirs.begin(), theirs.end(), [&](const auto& p) { return p.material == name; });
  };
  if (found || primitive != nullptr || AnyOther(made, of, has_material)) return true;
  return in_.errors->Add(*material, "{} has no material \"{}\"{}", of.name, name, DidYouMean(name, names));
}

}  // namespace kpsa::engine
