#include "cli/request.h"

#include "cli/frames_range.h"
#include "host/rig_frames.h"

namespace kpsa::engine {
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

Result<std::optional<VertexName>> FindVertex(const Rig& rig, const std::string& text) {
  const std::size_t open = text.rfind('[');
  if (open == std::string::npos || open == 0 || text.back() != ']') return std::optional<VertexName>();
  const std::string name = text.substr(0, open);
  std::vector<std::string> names;
  for (const CharacterMesh& mesh : rig.scene.meshes) {
    names.push_back(mesh.name);
    if (mesh.name != name) continue;
    const Result<std::vector<Index>> vertices =
        ParseIndices(text, text.substr(open + 1, text.size() - open - 2), mesh.vertex_count);
    if (!vertices.ok()) return vertices.status();
    if (vertices->size() != 1) return Status::Usage("{}: expected one vertex", text);
    return std::optional<VertexName>({&mesh, vertices->front()});
  }
  if (name.find('.') != std::string::npos) return std::optional<VertexName>();  // an attribute's element
  return Status::Usage("\"{}\": no mesh is called \"{}\"{}", text, name, DidYouMean(name, names));
}

}  // namespace kpsa::engine
