#include "host/mesh_stage.h"

#include <string>
#include <vector>

#include "base/text.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kMostStages = 8;  // that a message lists

std::vector<std::string> MeshNames(const Rig& rig) {
  std::vector<std::string> names;
  for (const CharacterMesh& mesh : rig.scene.meshes) names.push_back(mesh.name);
  return names;
}

const CharacterMesh* FindMesh(const Rig& rig, std::string_view name) {
  for (const CharacterMesh& mesh : rig.scene.meshes) {
    if (mesh.name == name) return &mesh;
  }
  return nullptr;
}

}  // namespace

Result<MeshStage> FindMeshStage(const Rig& rig, std::string_view text) {
  if (const CharacterMesh* mesh = FindMesh(rig, text)) return MeshStage{mesh, mesh->points};
  // Both may have an @ in their names: the longest mesh that exists
  const auto is_mesh = [&](std::string_view name) { return FindMesh(rig, name) != nullptr; };
  std::size_t at = LongestBefore('@', text, is_mesh);
  if (at == std::string_view::npos) at = text.rfind('@');
  const std::string_view name = text.substr(0, at);
  const CharacterMesh* mesh = FindMesh(rig, name);
  if (mesh == nullptr)
    return Status::Usage("\"{}\": no mesh is called \"{}\"{}", text, name, DidYouMean(name, MeshNames(rig)));
  const std::string_view stage_name = text.substr(at + 1);
  const Stage* stage = mesh->FindStage(stage_name);
  if (stage == nullptr) {
    std::vector<std::string> stages;
    for (const Stage& s : mesh->stages) stages.push_back(s.name);
    const Suggestion nearest = DidYouMean(stage_name, stages);
    const std::size_t count = stages.size();
    if (count > kMostStages) stages.resize(kMostStages - 2);
    return Status::Usage("\"{}\": the mesh has no stage \"{}\"{}; it has {}{}", text, stage_name, nearest,
                         fmt::join(stages, ", "),
                         count > kMostStages ? fmt::format(" and {} more", count - stages.size()) : "");
  }
  return MeshStage{mesh, stage->points};
}

Result<WantedPlug> FindWanted(const Rig& rig, std::string_view text) {
  const Result<PlugRef> plug = rig.graph->FindPlug(text);
  if (plug.ok()) return WantedPlug{*plug, nullptr};
  // With an @ it was meant as a mesh's stage, but where it is in a node's own name
  const bool of_node = LongestBefore('.', text, [&](std::string_view name) {
                         return name.find('@') != std::string_view::npos && rig.graph->FindNode(name).ok();
                       }) != std::string_view::npos;
  if (FindMesh(rig, text) != nullptr || (text.find('@') != std::string_view::npos && !of_node)) {
    const Result<MeshStage> stage = FindMeshStage(rig, text);
    if (!stage.ok()) return stage.status();
    return WantedPlug{stage->points, stage->mesh};
  }
  Status usage;
  for (const Error& error : plug.status().errors()) usage.Append(Status::Usage("{}", error.message));
  return usage;
}

}  // namespace kpsa::engine
