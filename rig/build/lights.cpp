// What an illumination sees: `meshes`, `carried`, `camera` and `lights` of a rig's node, by their names.
#include <algorithm>

#include "rig/build/rig_build.h"

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

// A node of the file that has all the outputs that are wanted of it.
std::optional<NodeId> RigBuild::FindWithOutputs(const YamlNode& name,
                                                std::initializer_list<const char*> outputs,
                                                const char* what) {
  const Made* made = FindMade(name.scalar);
  const auto fits = [&](const Made& candidate) {
    return std::all_of(outputs.begin(), outputs.end(), [&](const char* output) {
      const int number = graph().def(candidate.id).FindAttribute(output);
      return number >= 0 && graph().def(candidate.id).attributes[static_cast<std::size_t>(number)].output;
    });
  };
  if (made != nullptr && fits(*made)) return made->id;
  if (made != nullptr) {
    errors_->Add(name, "\"{}\" is a {}, no {}", name.scalar, graph().def(made->id).name, what);
    return std::nullopt;
  }
  if (written_.count(name.scalar) != 0) return std::nullopt;  // its own error was reported
  std::vector<std::string> names;
  for (const Made& candidate : made_) {
    if (fits(candidate)) names.push_back(candidate.from->name);
  }
  errors_->Add(name, "unknown {} \"{}\"{}", what, name.scalar, DidYouMean(name.scalar, names));
  return std::nullopt;
}

void RigBuild::ConnectLights() {
  for (Made& made : made_) {
    if (graph().def(made.id).name != "indirectIllumination" || errors_->full()) continue;
    const auto find = [&](const char* key) {
      return made.special.count(key) != 0 ? made.special[key] : nullptr;
    };
    GraphEditor edit(&graph());
    std::vector<std::size_t> meshes;
    if (const RigAttribute* listed = find("meshes")) {
      std::vector<const YamlNode*> names;
      if (!ReadNames(listed->value, "meshes", &names, errors_)) continue;
      for (const YamlNode* name : names) {
        if (const std::optional<std::size_t> mesh = FindMesh(name->scalar, name->where()))
          meshes.push_back(*mesh);
      }
    } else {
      meshes = ShownMeshes(rig_->scene);
    }
    for (std::size_t i = 0; i < meshes.size(); ++i) {
      const CharacterMesh& mesh = rig_->scene.meshes[meshes[i]];
      if (!mesh.world) {
        Fail(made.from->where,
             Status::Invalid("the points of \"{}\" are in mesh space, and light is in the world: "
                             "end its stack with its skin",
                             mesh.name));
      }
      edit.Connect(mesh.points, edit.Plug(made.id, "points", static_cast<int>(i)));
      edit.Set(made.id, "mesh", static_cast<int>(i), mesh.geometry.mesh);
    }
    std::vector<std::int64_t> carried;
    std::vector<std::string> carried_names;
    if (const RigAttribute* listed = find("carried")) {
      std::vector<const YamlNode*> names;
      if (!ReadNames(listed->value, "carried", &names, errors_)) continue;
      for (const YamlNode* name : names) {
        const std::optional<std::size_t> mesh = FindMesh(name->scalar, name->where());
        if (!mesh.has_value()) continue;
        const auto found = std::find(meshes.begin(), meshes.end(), *mesh);
        if (found == meshes.end()) {
          errors_->Add(*name, "carried: \"{}\" is none of the meshes that are lit", name->scalar);
          continue;
        }
        carried.push_back(found - meshes.begin());
        carried_names.push_back(name->scalar);
      }
    }
    edit.Set(made.id, "carriedMeshes", carried);
    for (const char* at_points : {"pointIrradiance", "keyPointIrradiance"})
      graph().SetElementNames(made.id, graph().def(made.id).FindAttribute(at_points), carried_names);
    if (const RigAttribute* camera = find("camera")) {
      if (const std::optional<NodeId> node = FindWithOutputs(camera->value, {"worldFromScreen"}, "camera"))
        edit.Connect(edit.Plug(*node, "worldFromScreen"), edit.Plug(made.id, "worldFromScreen"));
    } else {
      Fail(made.from->where, Status::Invalid("\"{}\" needs a \"camera\"", made.from->name));
    }
    std::vector<std::int64_t> kinds;
    std::vector<const YamlNode*> names;
    if (const RigAttribute* lights = find("lights");
        lights != nullptr && !ReadNames(lights->value, "lights", &names, errors_))
      continue;
    for (const YamlNode* name : names) {
      const std::optional<NodeId> node = FindWithOutputs(*name, {"outMatrix", "outColor"}, "light");
      if (!node.has_value()) continue;
      const std::string& type = graph().def(*node).name;
      const auto i = static_cast<int>(kinds.size());
      kinds.push_back(type == "areaLight" ? 1 : type == "sunLight" ? 2 : type == "sphereLight" ? 3 : 0);
      edit.Connect(edit.Plug(*node, "outMatrix"), edit.Plug(made.id, "lightMatrix", i));
      edit.Connect(edit.Plug(*node, "outColor"), edit.Plug(made.id, "lightColor", i));
    }
    edit.Set(made.id, "lightKinds", kinds);
    Fail(made.from->where, edit.Take());
  }
}

}  // namespace kpsa::engine
