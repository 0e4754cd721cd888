// `driver: cage_mesh` or `driver: "cage_mesh@skin"`: deformers that follow another mesh at a stage of its
// stack.
#include <algorithm>

#include "io/rig_build.h"

namespace kpsa {

// Stages may have an @ in their names, too: the longest mesh that exists wins. Without a mesh that exists,
// the text up to its last @; without an @, all of it is the mesh.
void RigBuild::SplitStage(const std::string& text, std::string* mesh, std::string* stage) const {
  const std::string whole = text;
  const auto is_mesh = [&](const std::string& name) {
    return std::any_of(rig_->scene.meshes.begin(), rig_->scene.meshes.end(), [&](const CharacterMesh& each) {
      return each.name == name || rig_->character->nodes[each.gltf_node].name == name;
    });
  };
  std::size_t at = whole.rfind('@');
  for (std::size_t shorter = at; shorter != std::string::npos && shorter > 0;
       shorter = whole.rfind('@', shorter - 1)) {
    if (!is_mesh(whole.substr(0, shorter))) continue;
    at = shorter;
    break;
  }
  *mesh = whole.substr(0, at);
  *stage = at == std::string::npos ? "" : whole.substr(at + 1);
}

const Stage* RigBuild::FindStage(const CharacterMesh& mesh, const std::string& stage,
                                 const SourceLocation& where) {
  const Stage* found = mesh.FindStage(stage);
  if (found != nullptr) return found;
  std::vector<std::string> names;
  for (const Stage& s : mesh.stages) names.push_back(s.name);
  Fail(where, Status::Invalid("\"{}\" has no stage \"{}\"{}; its stack is {}", mesh.name, stage,
                              DidYouMean(stage, names), fmt::join(names, ", ")));
  return nullptr;
}

void RigBuild::ConnectDrivers() {
  for (const Made& made : made_) {
    if (errors_->full()) return;
    if (graph().def(made.id).FindAttribute("driverPoints") < 0) continue;
    if (const auto it = made.special.find("driver"); it != made.special.end()) {
      ConnectDriver(made, *it->second);
    } else if (!made.geometries.empty()) {
      Fail(made.from->where,
           Status::Invalid("\"{}\" ({}) has no driver: expected driver: MESH, or driver: \"MESH@STAGE\"",
                           made.from->name, graph().def(made.id).name));
    }
  }
}

void RigBuild::ConnectDriver(const Made& made, const RigAttribute& driver) {
  const SourceLocation where = driver.value.where();
  std::string text, name, stage_name;
  if (!ReadString(driver.value, "driver", &text, errors_)) return;
  // A mesh may have an @ in its name
  const bool verbatim =
      std::any_of(rig_->scene.meshes.begin(), rig_->scene.meshes.end(), [&](const CharacterMesh& each) {
        return each.name == text || rig_->character->nodes[each.gltf_node].name == text;
      });
  if (verbatim) {
    name = text;
  } else {
    SplitStage(text, &name, &stage_name);
  }
  const std::optional<std::size_t> index = FindMesh(name, where);
  if (!index.has_value()) return;
  const CharacterMesh& mesh = rig_->scene.meshes[*index];
  PlugRef points = mesh.points;
  bool world = mesh.world;
  if (!stage_name.empty()) {
    const Stage* stage = FindStage(mesh, stage_name, where);
    if (stage == nullptr) return;
    points = stage->points;
    world = stage->world;
  }
  for (const Geometry& geometry : made.geometries) {
    if (geometry.mesh == index) {
      Fail(where,
           Status::Invalid("\"{}\" deforms {}, so {} cannot be its driver: a mesh does not drive itself",
                           made.from->name, geometry.name, mesh.name));
      return;
    }
  }
  if (mesh.mesh().data().triangles.empty()) {
    Fail(where, Status::Invalid("the driver \"{}\" has no faces", mesh.name));
    return;
  }
  if (!made.geometries.empty() && world != made.world) {
    const auto space = [](bool in_world) {
      return in_world ? "world space" : "mesh space (before the skin)";
    };
    Fail(where, Status::Invalid(
                    "\"{}\" deforms {} in {}, and the driver \"{}\" is in {}: name a stage of the "
                    "driver in the same space",
                    made.from->name, made.geometries.front().name, space(made.world), text, space(world)));
    return;
  }
  GraphEditor edit(&graph());
  edit.Set(made.id, "driverMesh", mesh.geometry.mesh);
  if (!world) edit.Set(made.id, "driverMatrix", rest_->WorldFromMesh(*index, {}));
  edit.Connect(points, edit.Plug(made.id, "driverPoints"));
  Fail(where, edit.Take());
}

}  // namespace kpsa
