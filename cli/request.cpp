#include "cli/request.h"

#include "base/text.h"
#include "cli/frames_range.h"
#include "cli/rig_frames.h"

namespace kpsa {
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
    const std::string nearest = DidYouMean(stage_name, stages);
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

Result<Request> BuildRequest(const Rig& rig, const std::vector<std::string>& wanted,
                             const std::optional<std::string>& vertices) {
  std::vector<WantedPlug> plugs;
  for (const std::string& text : wanted) {
    Result<WantedPlug> plug = FindWanted(rig, text);
    if (!plug.ok()) return plug.status();
    plugs.push_back(*plug);
  }
  if (wanted.empty()) {
    for (const std::size_t m : ShownMeshes(rig.scene)) {
      const CharacterMesh& mesh = rig.scene.meshes[m];
      plugs.push_back({mesh.points, &mesh});
    }
  }
  Request request;
  request.varying.push_back(rig.scene.time);
  for (const WantedPlug& plug : plugs) {
    RequestedOutput output{plug.plug, {}};
    output.plug.component = -1;
    if (vertices.has_value()) {
      if (plug.mesh == nullptr)
        return Status::Usage("--vertices is for the points of meshes, not for {}",
                             rig.graph->PlugName(plug.plug));
      const Result<std::vector<Index>> indices =
          ParseIndices("--vertices", *vertices, plug.mesh->vertex_count);
      if (!indices.ok()) return indices.status();
      std::vector<Index> points;
      for (Index vertex : *indices) points.push_back(plug.mesh->mesh().data().vertex_to_point[vertex]);
      output.points = PointSet::Of(std::move(points), plug.mesh->mesh().point_count());
    }
    request.outputs.push_back(std::move(output));
  }
  return request;
}

Result<Request> AcceleratedRequest(Rig* rig, Compiler* compiler, const AccelerationFlags& flags,
                                   const std::vector<std::string>& wanted,
                                   const std::optional<std::string>& vertices) {
  std::vector<AppliedSubspace> applied;
  if (flags.wanted()) {
    Result<std::vector<AppliedSubspace>> result = ApplyAcceleration(rig, compiler, flags);
    if (!result.ok()) return result.status();
    applied = std::move(*result);
  }
  Result<Request> request = BuildRequest(*rig, wanted, vertices);
  if (!request.ok()) return request;
  ReadColorsFrom(applied, *rig->graph, &*request);
  for (const AppliedSubspace& one : applied) {
    for (std::size_t p = 0; p < one.entry.points.size() && wanted.empty() && !vertices.has_value(); ++p) {
      if (one.entry.points[p].colors) request->outputs.push_back({one.Output(*rig->graph, p), {}});
    }
  }
  return request;
}

}  // namespace kpsa
