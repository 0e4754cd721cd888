#include "rig/build/deformer_weights.h"

#include <algorithm>

#include "rig/character/mesh_weights.h"

namespace kpsa::engine {
namespace {

// "hero:" of a deformer that a reference brought along, "" of the rig's own.
std::string NamespaceOf(const Rig& rig, const DeformedMesh& of) {
  const Reference* reference = InnermostReference(rig, of.stage->node);
  return reference == nullptr ? "" : reference->name_space;
}

}  // namespace

Result<DeformedMesh> FindDeformed(const Rig& rig, std::string_view text) {
  std::vector<DeformedMesh> found;
  std::vector<std::string> names, stages;
  for (const CharacterMesh& mesh : rig.scene.meshes) {
    for (const Stage& stage : mesh.stages) {
      const std::string& name = rig.graph->name(stage.node);
      const std::string by_stage = mesh.name + "@" + stage.name;
      if (text == name || text == by_stage) {
        if (stage.name == "morph" || stage.name == "transform")
          return Status::Usage("{}: the character's own {} takes no weights", text, stage.name);
        found.push_back({&mesh, &stage});
        stages.push_back(by_stage);
      } else {
        names.push_back(name);
        names.push_back(by_stage);
      }
    }
  }
  if (found.empty())
    return Status::Usage("no stack of the rig has a deformer \"{}\"{}", text,
                         DidYouMean(std::string(text), names));
  if (found.size() > 1)
    return Status::Usage("{} deforms {} meshes: expected one of {}", text, found.size(),
                         fmt::join(stages, ", "));
  return found[0];
}

std::string OwnName(const Rig& rig, const DeformedMesh& of, const std::string& name) {
  const std::string prefix = NamespaceOf(rig, of);
  return name.starts_with(prefix) ? name.substr(prefix.size()) : name;
}

WeightFile InOwnNames(const Rig& rig, const DeformedMesh& of, WeightFile file) {
  file.mesh = OwnName(rig, of, file.mesh);
  for (NamedWeights& map : file.maps) map.name = OwnName(rig, of, map.name);
  return file;
}

std::vector<float> PointWeights(const Rig& rig, const DeformedMesh& of) {
  const int attribute = rig.graph->def(of.stage->node).FindAttribute("weights");
  const Value* value = rig.graph->FindValue({of.stage->node, attribute, of.stage->geometry, -1});
  const auto* map = value == nullptr ? nullptr : value->asset<WeightMap>();
  return map != nullptr ? map->weights() : std::vector<float>(of.mesh->mesh().point_count(), 1.0f);
}

Result<WeightFile> DeformerWeights(const Rig& rig, const DeformedMesh& of) {
  const CharacterMesh& mesh = *of.mesh;
  Result<WeightFile> file = of.is_skin()
                                ? SkinWeights(mesh, *mesh.influences, *rig.graph)
                                : VertexWeights(mesh, rig.graph->name(of.stage->node), PointWeights(rig, of));
  if (!file.ok()) return file.status();
  return InOwnNames(rig, of, std::move(*file));
}

Status CheckWeights(const Rig& rig, const DeformedMesh& of, const WeightFile& file) {
  const CharacterMesh& mesh = *of.mesh;
  const std::string prefix = NamespaceOf(rig, of);
  WeightFile here = file;
  here.mesh.insert(0, prefix);
  for (NamedWeights& map : here.maps) map.name.insert(0, prefix);
  if (!NamesMesh(here, *rig.character, *rig.graph, mesh))
    return Status::Invalid("is for mesh \"{}\", expected \"{}\"", file.mesh, OwnName(rig, of, mesh.name))
        .At({file.path});
  if (file.points != mesh.vertex_count)
    return Status::Invalid("is for {} vertices; {} has {}", file.points, mesh.name, mesh.vertex_count)
        .At({file.path});
  return of.is_skin() ? InfluencesFrom(here, mesh, *rig.graph).status() : Status();
}

}  // namespace kpsa::engine
