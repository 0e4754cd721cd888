#include "rig/build/made_nodes.h"

#include <algorithm>

namespace kpsa::engine {

Index VertexCount(const CharacterGraph& scene, const DeformedGeometry& of) {
  return of.mesh.has_value() ? scene.meshes[*of.mesh].vertex_count : static_cast<Index>(of.count);
}

Index PointOf(const CharacterGraph& scene, const DeformedGeometry& of, Index vertex) {
  return of.mesh.has_value() ? scene.meshes[*of.mesh].mesh().data().vertex_to_point[vertex] : vertex;
}

void MadeNodes::Add(const RigNode& from, NodeId id) {
  by_node_[id.index] = list_.size();
  by_name_[from.name] = list_.size();
  list_.push_back({&from, id});
}

MadeNode* MadeNodes::Find(const std::string& name) {
  const auto it = by_name_.find(name);
  return it == by_name_.end() ? nullptr : &list_[it->second];
}

MadeNode* MadeNodes::Find(NodeId id) {
  const auto it = by_node_.find(id.index);
  return it == by_node_.end() ? nullptr : &list_[it->second];
}

std::optional<NodeId> FindWithOutputs(const BuildInput& in, const MadeNodes& nodes, const YamlNode& name,
                                      std::initializer_list<const char*> outputs, const char* what) {
  const MadeNode* made = nodes.Find(name.scalar);
  const auto fits = [&](const MadeNode& candidate) {
    return std::all_of(outputs.begin(), outputs.end(), [&](const char* output) {
      const int number = in.graph().def(candidate.id).FindAttribute(output);
      return number >= 0 && in.graph().def(candidate.id).attributes[static_cast<std::size_t>(number)].output;
    });
  };
  if (made != nullptr && fits(*made)) return made->id;
  if (made != nullptr) {
    in.errors->Add(name, "\"{}\" is a {}, no {}", name.scalar, in.graph().def(made->id).name, what);
    return std::nullopt;
  }
  if (in.names.IsWritten(name.scalar)) return std::nullopt;  // its own error was reported
  std::vector<std::string> names;
  for (const MadeNode& candidate : nodes) {
    if (fits(candidate)) names.push_back(candidate.from->name);
  }
  in.errors->Add(name, "unknown {} \"{}\"{}", what, name.scalar, DidYouMean(name.scalar, names));
  return std::nullopt;
}

}  // namespace kpsa::engine
