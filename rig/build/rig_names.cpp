#include "rig/build/rig_names.h"

#include <algorithm>

#include "base/text.h"

namespace kpsa::engine {

RigNames::RigNames(const RigFile& file, const Rig& rig, YamlErrors* errors) : rig_(rig), errors_(errors) {
  for (std::size_t n = 0; n < file.nodes.size(); ++n) written_.emplace(file.nodes[n].name, n);
  for (const RigDeform& deform : file.deform) {
    for (const RigString& item : deform.stack) in_stacks_.insert(item.text);
  }
  for (Index i = 0; i < rig.character->nodes.size(); ++i) {
    const std::string& name = rig.character->nodes[i].name;
    gltf_by_name_[name.empty() ? fmt::format("node{}", i) : name].push_back(i);
    gltf_by_node_[rig.scene.transforms[i].index] = i;
  }
}

bool RigNames::Fail(const SourceLocation& where, Status status) const {
  if (status.ok()) return true;
  errors_->Append(std::move(status).At(where));
  return false;
}

bool RigNames::LacksNodeOf(const std::string& plug) const {
  if (errors_->ok()) return false;
  for (std::size_t dot = plug.find('.'); dot != std::string::npos; dot = plug.find('.', dot + 1)) {
    const std::string node = plug.substr(0, dot);
    if (IsWritten(node) && !rig_.graph->FindNode(node).ok()) return true;
  }
  return false;
}

Index RigNames::GltfNode(NodeId node) const {
  const auto it = gltf_by_node_.find(node.index);
  return it == gltf_by_node_.end() ? kNoIndex : it->second;
}

std::optional<std::size_t> RigNames::FindMesh(const std::string& name, const SourceLocation& where) const {
  std::vector<std::size_t> found;
  const auto by_name = gltf_by_name_.find(name);
  const Result<NodeId> by_plug_name =
      by_name == gltf_by_name_.end() ? rig_.graph->FindNode(name) : Result<NodeId>(NodeId());
  for (std::size_t m = 0; m < rig_.scene.meshes.size(); ++m) {
    const CharacterMesh& mesh = rig_.scene.meshes[m];
    const bool verbatim =
        by_name != gltf_by_name_.end() &&
        std::find(by_name->second.begin(), by_name->second.end(), mesh.gltf_node) != by_name->second.end();
    if (verbatim || mesh.name == name || (by_plug_name.ok() && *by_plug_name == mesh.transform))
      found.push_back(m);
  }
  if (found.size() == 1) return found[0];
  if (found.empty()) {
    std::vector<std::string> names;
    for (const CharacterMesh& mesh : rig_.scene.meshes) names.push_back(mesh.name);
    Fail(where, Status::Invalid("unknown mesh \"{}\"{}", name, DidYouMean(name, names)));
    return std::nullopt;
  }
  std::vector<std::string> several;
  for (std::size_t m : found) several.push_back(rig_.scene.meshes[m].name);
  Fail(where,
       Status::Invalid("\"{}\" is the name of several meshes: write {}", name, fmt::join(several, " or ")));
  return std::nullopt;
}

std::optional<NodeId> RigNames::FindTransform(const std::string& name, const SourceLocation& where) const {
  std::vector<std::string> several;
  NodeId only;
  if (const auto it = gltf_by_name_.find(name); it != gltf_by_name_.end()) {
    for (Index i : it->second) {
      if (rig_.character->nodes[i].mesh != kNoIndex) continue;
      only = rig_.scene.transforms[i];
      several.push_back(rig_.graph->name(only));
    }
  }
  if (several.size() == 1) return only;
  if (several.size() > 1) {
    Fail(where, Status::Invalid("\"{}\" is the name of several transforms: write {}", name,
                                fmt::join(several, " or ")));
    return std::nullopt;
  }
  const Result<NodeId> found = rig_.graph->FindNode(name);
  if (!found.ok()) {
    Fail(where, found.status());
    return std::nullopt;
  }
  if (rig_.graph->def(*found).FindAttribute("worldMatrix") < 0) {
    Fail(where, Status::Invalid("\"{}\" is a {}; expected a transform", name, rig_.graph->def(*found).name));
    return std::nullopt;
  }
  return *found;
}

void RigNames::SplitStage(const std::string& text, std::string* mesh, std::string* stage) const {
  const std::string whole = text;
  const auto is_mesh = [&](std::string_view name) {
    return std::any_of(rig_.scene.meshes.begin(), rig_.scene.meshes.end(), [&](const CharacterMesh& each) {
      return each.name == name || rig_.character->nodes[each.gltf_node].name == name;
    });
  };
  std::size_t at = LongestBefore('@', whole, is_mesh);
  if (at == std::string::npos) at = whole.rfind('@');
  *mesh = whole.substr(0, at);
  *stage = at == std::string::npos ? "" : whole.substr(at + 1);
}

const Stage* RigNames::FindStage(const CharacterMesh& mesh, const std::string& stage,
                                 const SourceLocation& where) const {
  const Stage* found = mesh.FindStage(stage);
  if (found != nullptr) return found;
  // Another error says why that stack was not made
  if (!errors_->ok() && IsWritten(stage) && in_stacks_.count(stage) != 0) return nullptr;
  std::vector<std::string> names;
  for (const Stage& s : mesh.stages) names.push_back(s.name);
  Fail(where, Status::Invalid("\"{}\" has no stage \"{}\"{}; its stack is {}", mesh.name, stage,
                              DidYouMean(stage, names), fmt::join(names, ", ")));
  return nullptr;
}

}  // namespace kpsa::engine
