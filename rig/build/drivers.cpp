// `driver:` of deformers that follow another mesh at a stage of its stack, and of poseInterpolators.
#include <algorithm>

#include "base/text.h"
#include "rig/build/rig_build.h"

namespace kpsa::engine {

// Stages may have an @ in their names, too: the longest mesh that exists wins. Without a mesh that exists,
// the text up to its last @; without an @, all of it is the mesh.
void RigBuild::SplitStage(const std::string& text, std::string* mesh, std::string* stage) const {
  const std::string whole = text;
  const auto is_mesh = [&](std::string_view name) {
    return std::any_of(rig_->scene.meshes.begin(), rig_->scene.meshes.end(), [&](const CharacterMesh& each) {
      return each.name == name || rig_->character->nodes[each.gltf_node].name == name;
    });
  };
  std::size_t at = LongestBefore('@', whole, is_mesh);
  if (at == std::string::npos) at = whole.rfind('@');
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
    if (graph().def(made.id).name == "poseInterpolator") ReadPoses(made);
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
    Fail(where,
         Status::Invalid("\"{}\" deforms {} in {}, and the driver \"{}\" is in {}: name a stage of the "
                         "driver in the same space",
                         made.from->name, made.geometries.front().name, SpaceName(made.world), text,
                         SpaceName(world)));
    return;
  }
  GraphEditor edit(&graph());
  edit.Set(made.id, "driverMesh", mesh.geometry.mesh);
  if (edit.Has(made.id, "driverUvs")) {
    std::shared_ptr<const TriangleUvs> uvs = UvsOf(*index);
    if (uvs != nullptr) edit.Set(made.id, "driverUvs", std::move(uvs));
  }
  if (!world) edit.Set(made.id, "driverMatrix", rest_->WorldFromMesh(*index, {}));
  edit.Connect(points, edit.Plug(made.id, "driverPoints"));
  Fail(where, edit.Take());
}

// Of the mesh's triangles; null where the file has none.
std::shared_ptr<const TriangleUvs> RigBuild::UvsOf(std::size_t index) {
  const CharacterMesh& mesh = rig_->scene.meshes[index];
  const std::vector<float>& by_vertex =
      rig_->character->meshes[rig_->character->nodes[mesh.gltf_node].mesh].uvs;
  if (by_vertex.empty()) return nullptr;
  std::shared_ptr<const TriangleUvs>& uvs = uvs_[index];
  if (uvs == nullptr) {
    std::vector<float> values;
    for (const Index vertex : mesh.mesh().data().triangle_vertices)
      values.insert(values.end(), &by_vertex[2 * std::size_t{vertex}],
                    &by_vertex[2 * std::size_t{vertex}] + 2);
    uvs = std::make_shared<const TriangleUvs>(std::move(values));
  }
  return uvs;
}

// A poseInterpolator's `driver: TRANSFORM` and `poses: {name: [x, y, z], ...}`.
void RigBuild::ReadPoses(const Made& made) {
  GraphEditor edit(&graph());
  if (const auto it = made.special.find("driver"); it != made.special.end()) {
    const YamlNode& value = it->second->value;
    std::string name;
    if (!ReadString(value, "driver", &name, errors_)) return;
    const std::optional<NodeId> transform = FindTransform(name, value.where());
    if (!transform.has_value()) return;
    edit.Connect(edit.Plug(*transform, "matrix"), edit.Plug(made.id, "matrix"));
    const Value* rest = graph().FindValue(edit.Plug(*transform, "restMatrix"));
    edit.Set(made.id, "restMatrix", rest != nullptr ? *rest : Value(LocalAtRest(*transform)));
    if (!Fail(value.where(), edit.Take())) return;
  }
  const auto it = made.special.find("poses");
  if (it == made.special.end()) return;
  const YamlNode& poses = it->second->value;
  if (!poses.is_map() || poses.items.empty()) {
    errors_->Add(poses, "poses: expected a map of rotations, {{open: [-25, 0, 0], ...}}, found {}",
                 poses.is_map() ? "an empty one" : poses.kind_name());
    return;
  }
  std::vector<double> angles;
  std::vector<std::string> names;
  for (std::size_t i = 0; i < poses.items.size(); ++i) {
    std::vector<double> one;
    names.push_back(poses.keys[i].scalar);
    if (!ReadNumbers(poses.items[i], fmt::format("pose \"{}\"", names.back()), Unit::kAngle,
                     units(it->second->source), 3, &one, errors_))
      return;
    angles.insert(angles.end(), one.begin(), one.end());
  }
  edit.Set(made.id, "poseAngles", Value(std::move(angles)));
  edit.Set(made.id, "poseNames", Value(fmt::format("{}", fmt::join(names, "\n"))));
  const PlugRef weight = edit.Plug(made.id, "outputWeight", 0);
  if (edit.ok()) graph().SetElementNames(made.id, weight.attribute, std::move(names));
  Fail(poses.where(), edit.Take());
}

// What remembers its previous frame follows the scene's time, unless the rig gives it another one.
void RigBuild::ConnectTime() {
  for (const Made& made : made_) {
    if (!graph().def(made.id).stateful || graph().def(made.id).FindAttribute("time") < 0) continue;
    GraphEditor edit(&graph());
    const PlugRef time = edit.Plug(made.id, "time");
    if (graph().FindValue(time) != nullptr || graph().FindConnection(time) != nullptr) continue;
    edit.Connect(rig_->scene.time, time);
    Fail(made.from->where, edit.Take());
  }
}

}  // namespace kpsa::engine
