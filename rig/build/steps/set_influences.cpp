#include "rig/build/steps/set_influences.h"

#include "rig/character/mesh_weights.h"
#include "rig/graph_editor.h"

namespace kpsa::engine {
namespace {

void SetInfluencesOf(const BuildInput& in, const MadeNode& made, WeightMaps* maps, CharacterGraph* scene,
                     Graph* graph) {
  const RigAttribute* key = made.Find("influences");
  if (key == nullptr || in.errors->full()) return;
  const YamlNode& value = key->value;
  std::string text;
  if (!ReadString(value, "influences", &text, in.errors)) return;
  const auto path = ResolvePath(in.file, key->source, text, value, in.errors);
  if (!path.has_value()) return;
  const WeightFile* file = maps->FindFile(value, *path);
  const DeformedGeometry* of = nullptr;
  if (file == nullptr || !maps->FindGeometry(value, made, *file, file->path, &of)) return;
  CharacterMesh& mesh = scene->meshes[*of->mesh];
  Result<std::shared_ptr<const Influences>> influences = InfluencesFrom(*file, mesh, *graph);
  if (!in.errors->Add(value, influences.status())) return;
  maps->Note(made, *key, of->name, file->path);
  mesh.influences = std::move(*influences);
  GraphEditor edit(graph);
  edit.Set(made.id, "influences", 0, mesh.influences);
  in.Fail(value.where(), edit.Take());
}

}  // namespace

void SetInfluences(const BuildInput& in, const OwnDeformers& own, WeightMaps* maps, CharacterGraph* scene,
                   Graph* graph) {
  for (const MadeNode& made : own.made) SetInfluencesOf(in, made, maps, scene, graph);
}

}  // namespace kpsa::engine
