#include "rig/build/steps/set_targets.h"

#include "rig/graph_editor.h"

namespace kpsa::engine {
namespace {

void SetTargetsOf(const BuildInput& in, const MadeNode& made, Graph* graph) {
  const RigAttribute* key = made.Find("targets");
  if (graph->def(made.id).name != "blendShape" || key == nullptr || made.geometries.empty()) return;
  const YamlNode& value = key->value;
  std::vector<const YamlNode*> names;
  if (value.is_scalar()) names.push_back(&value);
  for (const YamlNode& item : value.items) names.push_back(&item);
  std::vector<std::vector<MorphTargets::Target>> targets(made.geometries.size());
  std::vector<std::string> known;
  for (const DeformedGeometry& of : made.geometries) {
    if (!of.mesh.has_value()) {
      in.errors->Add(value, "targets: {} is no mesh", of.name);
      return;
    }
    const MorphTargets* from = in.rig.scene.meshes[*of.mesh].geometry.targets.get();
    for (std::size_t k = 0; from != nullptr && k < from->targets().size(); ++k)
      known.push_back(from->targets()[k].name);
  }
  bool good = true;
  for (const YamlNode* name : names) {
    bool found = false;
    for (std::size_t g = 0; g < targets.size(); ++g) {
      const MorphTargets* from = in.rig.scene.meshes[*made.geometries[g].mesh].geometry.targets.get();
      targets[g].push_back({name->scalar, {}, {}});
      for (std::size_t k = 0; from != nullptr && k < from->targets().size(); ++k) {
        if (from->targets()[k].name != name->scalar) continue;
        targets[g].back() = from->targets()[k];
        found = true;
        break;
      }
    }
    if (!found)
      good = in.errors->Add(*name, "targets: \"{}\" is no target of {}{}", name->scalar,
                            made.geometries.front().name, DidYouMean(name->scalar, known));
  }
  if (!good) return;
  GraphEditor edit(graph);
  for (std::size_t g = 0; g < targets.size(); ++g) {
    const auto points = static_cast<Index>(made.geometries[g].count);
    edit.Set(made.id, "targets", static_cast<int>(g),
             std::make_shared<const MorphTargets>(std::move(targets[g]), points));
  }
  in.Fail(made.from->where, edit.Take());
}

}  // namespace

void SetTargets(const BuildInput& in, const MadeNodes& nodes, Graph* graph) {
  for (const MadeNode& made : nodes) SetTargetsOf(in, made, graph);
}

}  // namespace kpsa::engine
