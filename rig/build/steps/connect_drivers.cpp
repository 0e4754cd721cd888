#include "rig/build/steps/connect_drivers.h"

#include <algorithm>
#include <map>
#include <memory>

#include "rig/file/values.h"
#include "rig/graph_editor.h"

namespace kpsa::engine {
namespace {

using MeshUvs =
    std::map<std::size_t, std::shared_ptr<const TriangleUvs>>;  // by mesh, of those that were asked for

// Of the mesh's triangles; null where the file has none.
std::shared_ptr<const TriangleUvs> UvsOf(const BuildInput& in, std::size_t index, MeshUvs* known) {
  const CharacterMesh& mesh = in.rig.scene.meshes[index];
  const std::vector<float>& by_vertex =
      in.rig.character->meshes[in.rig.character->nodes[mesh.gltf_node].mesh].uvs;
  if (by_vertex.empty()) return nullptr;
  std::shared_ptr<const TriangleUvs>& uvs = (*known)[index];
  if (uvs == nullptr) {
    std::vector<float> values;
    for (const Index vertex : mesh.mesh().data().triangle_vertices)
      values.insert(values.end(), &by_vertex[2 * std::size_t{vertex}],
                    &by_vertex[2 * std::size_t{vertex}] + 2);
    uvs = std::make_shared<const TriangleUvs>(std::move(values));
  }
  return uvs;
}

void ConnectDriver(const BuildInput& in, const MadeNode& made, const RigAttribute& driver, RestPose* rest,
                   MeshUvs* known_uvs, Graph* graph) {
  const SourceLocation where = driver.value.where();
  std::string text, name, stage_name;
  if (!ReadString(driver.value, "driver", &text, in.errors)) return;
  // A mesh may have an @ in its name
  const bool verbatim =
      std::any_of(in.rig.scene.meshes.begin(), in.rig.scene.meshes.end(), [&](const CharacterMesh& each) {
        return each.name == text || in.rig.character->nodes[each.gltf_node].name == text;
      });
  if (verbatim) {
    name = text;
  } else {
    in.names.SplitStage(text, &name, &stage_name);
  }
  const std::optional<std::size_t> index = in.names.FindMesh(name, where);
  if (!index.has_value()) return;
  const CharacterMesh& mesh = in.rig.scene.meshes[*index];
  PlugRef points = mesh.points;
  bool world = mesh.world;
  if (!stage_name.empty()) {
    const Stage* stage = in.names.FindStage(mesh, stage_name, where);
    if (stage == nullptr) return;
    points = stage->points;
    world = stage->world;
  }
  for (const DeformedGeometry& geometry : made.geometries) {
    if (geometry.mesh == index) {
      in.Fail(where,
              Status::Invalid("\"{}\" deforms {}, so {} cannot be its driver: a mesh does not drive itself",
                              made.from->name, geometry.name, mesh.name));
      return;
    }
  }
  if (mesh.mesh().data().triangles.empty()) {
    in.Fail(where, Status::Invalid("the driver \"{}\" has no faces", mesh.name));
    return;
  }
  if (!made.geometries.empty() && world != made.world) {
    in.Fail(where,
            Status::Invalid("\"{}\" deforms {} in {}, and the driver \"{}\" is in {}: name a stage of the "
                            "driver in the same space{}",
                            made.from->name, made.geometries.front().name, SpaceName(made.world), text,
                            SpaceName(world),
                            made.world ? "" : ", or write restSkin before it in its stack, instead of skin"));
    return;
  }
  GraphEditor edit(graph);
  edit.Set(made.id, "driverMesh", mesh.geometry.mesh);
  if (edit.Has(made.id, "driverUvs")) {
    std::shared_ptr<const TriangleUvs> uvs = UvsOf(in, *index, known_uvs);
    if (uvs != nullptr) edit.Set(made.id, "driverUvs", std::move(uvs));
  }
  if (!world) edit.Set(made.id, "driverMatrix", rest->WorldFromMesh(*index, {}));
  edit.Connect(points, edit.Plug(made.id, "driverPoints"));
  in.Fail(where, edit.Take());
}

// A poseInterpolator's `driver: TRANSFORM` and `poses: {name: [x, y, z], ...}`.
void ReadPoses(const BuildInput& in, const MadeNode& made, Graph* graph) {
  GraphEditor edit(graph);
  if (const RigAttribute* driver = made.Find("driver")) {
    const YamlNode& value = driver->value;
    std::string name;
    if (!ReadString(value, "driver", &name, in.errors)) return;
    const std::optional<NodeId> transform = in.names.FindTransform(name, value.where());
    if (!transform.has_value()) return;
    edit.Connect(edit.Plug(*transform, "matrix"), edit.Plug(made.id, "matrix"));
    const Value* rest = graph->FindValue(edit.Plug(*transform, "restMatrix"));
    edit.Set(made.id, "restMatrix", rest != nullptr ? *rest : Value(LocalAtRest(in.rig, *transform)));
    if (!in.Fail(value.where(), edit.Take())) return;
  }
  const RigAttribute* key = made.Find("poses");
  if (key == nullptr) return;
  const YamlNode& poses = key->value;
  if (!poses.is_map() || poses.items.empty()) {
    in.errors->Add(poses, "poses: expected a map of rotations, {{open: [-25, 0, 0], ...}}, found {}",
                   poses.is_map() ? "an empty one" : poses.kind_name());
    return;
  }
  std::vector<double> angles;
  std::vector<std::string> names;
  for (std::size_t i = 0; i < poses.items.size(); ++i) {
    std::vector<double> one;
    names.push_back(poses.keys[i].scalar);
    if (!ReadNumbers(poses.items[i], fmt::format("pose \"{}\"", names.back()), Unit::kAngle,
                     in.units(key->source), 3, &one, in.errors))
      return;
    angles.insert(angles.end(), one.begin(), one.end());
  }
  edit.Set(made.id, "poseAngles", Value(std::move(angles)));
  edit.Set(made.id, "poseNames", Value(fmt::format("{}", fmt::join(names, "\n"))));
  const PlugRef weight = edit.Plug(made.id, "outputWeight", 0);
  if (edit.ok()) graph->SetElementNames(made.id, weight.attribute, std::move(names));
  in.Fail(poses.where(), edit.Take());
}

}  // namespace

void ConnectDrivers(const BuildInput& in, const MadeNodes& nodes, RestPose* rest, Graph* graph) {
  MeshUvs uvs;
  for (const MadeNode& made : nodes) {
    if (in.errors->full()) return;
    if (graph->def(made.id).name == "poseInterpolator") ReadPoses(in, made, graph);
    if (graph->def(made.id).FindAttribute("driverPoints") < 0) continue;
    if (const RigAttribute* driver = made.Find("driver")) {
      ConnectDriver(in, made, *driver, rest, &uvs, graph);
    } else if (!made.geometries.empty()) {
      in.Fail(made.from->where,
              Status::Invalid("\"{}\" ({}) has no driver: expected driver: MESH, or driver: \"MESH@STAGE\"",
                              made.from->name, graph->def(made.id).name));
    }
  }
}

}  // namespace kpsa::engine
