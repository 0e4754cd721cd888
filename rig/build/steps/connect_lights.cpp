#include "rig/build/steps/connect_lights.h"

#include <algorithm>

#include "rig/graph_editor.h"

namespace kpsa::engine {
namespace {

bool ReadNames(const YamlNode& node, const char* key, std::vector<const YamlNode*>* names,
               YamlErrors* errors) {
  if (!node.is_sequence()) return errors->Add(node, "{}: expected a list of names", key);
  for (const YamlNode& item : node.items) {
    if (item.is_sequence() || item.is_map()) return errors->Add(item, "{}: expected a name", key);
    names->push_back(&item);
  }
  return true;
}

}  // namespace

void ConnectLights(const BuildInput& in, const MadeNodes& nodes, Graph* graph) {
  for (const MadeNode& made : nodes) {
    if (graph->def(made.id).name != "indirectIllumination" || in.errors->full()) continue;
    GraphEditor edit(graph);
    std::vector<std::size_t> meshes;
    if (const RigAttribute* listed = made.Find("meshes")) {
      std::vector<const YamlNode*> names;
      if (!ReadNames(listed->value, "meshes", &names, in.errors)) continue;
      for (const YamlNode* name : names) {
        if (const std::optional<std::size_t> mesh = in.names.FindMesh(name->scalar, name->where()))
          meshes.push_back(*mesh);
      }
    } else {
      meshes = ShownMeshes(in.rig.scene);
    }
    for (std::size_t i = 0; i < meshes.size(); ++i) {
      const CharacterMesh& mesh = in.rig.scene.meshes[meshes[i]];
      if (!mesh.world) {
        in.Fail(made.from->where,
                Status::Invalid("the points of \"{}\" are in mesh space, and light is in the world: "
                                "end its stack with its skin",
                                mesh.name));
      }
      edit.Connect(mesh.points, edit.Plug(made.id, "points", static_cast<int>(i)));
      edit.Set(made.id, "mesh", static_cast<int>(i), mesh.geometry.mesh);
    }
    std::vector<std::int64_t> carried;
    std::vector<std::string> carried_names;
    if (const RigAttribute* listed = made.Find("carried")) {
      std::vector<const YamlNode*> names;
      if (!ReadNames(listed->value, "carried", &names, in.errors)) continue;
      for (const YamlNode* name : names) {
        const std::optional<std::size_t> mesh = in.names.FindMesh(name->scalar, name->where());
        if (!mesh.has_value()) continue;
        const auto found = std::find(meshes.begin(), meshes.end(), *mesh);
        if (found == meshes.end()) {
          in.errors->Add(*name, "carried: \"{}\" is none of the meshes that are lit", name->scalar);
          continue;
        }
        carried.push_back(found - meshes.begin());
        carried_names.push_back(name->scalar);
      }
    }
    edit.Set(made.id, "carriedMeshes", carried);
    for (const char* at_points : {"pointIrradiance", "keyPointIrradiance"})
      graph->SetElementNames(made.id, graph->def(made.id).FindAttribute(at_points), carried_names);
    if (const RigAttribute* camera = made.Find("camera")) {
      if (const std::optional<NodeId> node =
              FindWithOutputs(in, nodes, camera->value, {"worldFromScreen"}, "camera"))
        edit.Connect(edit.Plug(*node, "worldFromScreen"), edit.Plug(made.id, "worldFromScreen"));
    } else {
      in.Fail(made.from->where, Status::Invalid("\"{}\" needs a \"camera\"", made.from->name));
    }
    std::vector<std::int64_t> kinds;
    std::vector<const YamlNode*> names;
    if (const RigAttribute* lights = made.Find("lights");
        lights != nullptr && !ReadNames(lights->value, "lights", &names, in.errors))
      continue;
    for (const YamlNode* name : names) {
      const std::optional<NodeId> node =
          FindWithOutputs(in, nodes, *name, {"outMatrix", "outColor"}, "light");
      if (!node.has_value()) continue;
      const std::string& type = graph->def(*node).name;
      const auto i = static_cast<int>(kinds.size());
      kinds.push_back(type == "areaLight" ? 1 : type == "sunLight" ? 2 : type == "sphereLight" ? 3 : 0);
      edit.Connect(edit.Plug(*node, "outMatrix"), edit.Plug(made.id, "lightMatrix", i));
      edit.Connect(edit.Plug(*node, "outColor"), edit.Plug(made.id, "lightColor", i));
    }
    edit.Set(made.id, "lightKinds", kinds);
    in.Fail(made.from->where, edit.Take());
  }
}

}  // namespace kpsa::engine
