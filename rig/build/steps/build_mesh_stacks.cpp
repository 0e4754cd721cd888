#include "rig/build/steps/build_mesh_stacks.h"

#include <algorithm>

#include "base/matrix.h"
#include "rig/build/stack_parts.h"
#include "rig/graph_editor.h"

namespace kpsa::engine {
namespace {

// The file's skin with its joints at rest, for a mesh that something else moves.
NodeId AddRestSkin(const BuildInput& in, const RestPose& rest, const CharacterMesh& mesh,
                   const RigString& item, Graph* graph) {
  GraphEditor edit(graph);
  const NodeId node = edit.AddFresh("skinCluster", mesh.name + "_restSkin");
  edit.Set(node, "influences", 0, mesh.influences);
  // It stands in the world, and goes along with a reference as all that does
  const NodeId place = edit.AddFresh("transform", mesh.name + "_restPlace");
  for (std::size_t j = 0; j < mesh.influence_nodes.size(); ++j) {
    const int element = static_cast<int>(j);
    const Matrix4& joint = rest.NodeWorld(in.names.GltfNode(mesh.influence_nodes[j]));
    edit.Set(node, "bindPreMatrix", element, joint * mesh.inverse_binds[j]);
    edit.Connect(edit.Plug(place, "worldMatrix"), edit.Plug(node, "matrix", element));
  }
  in.Fail(item.where, edit.Take());
  return node;
}

// The stage that takes a mesh of the file to the world is its own, or `restSkin` where the stack has that.
bool ChooseSkin(const BuildInput& in, const RigDeform& deform, const CharacterMesh& mesh,
                const RestPose& rest, Stage* into_world, Graph* graph) {
  const auto item = std::find_if(deform.stack.begin(), deform.stack.end(),
                                 [](const RigString& each) { return each.text == "restSkin"; });
  if (item == deform.stack.end()) return true;
  if (into_world->name != "skin") {
    return in.Fail(item->where,
                   Status::Invalid("mesh \"{}\" has no skin: leave \"restSkin\" out", mesh.name));
  }
  for (const RigString& other : deform.stack) {
    if (other.text == "skin" || other.text == "gltf") {
      return in.Fail(other.where,
                     Status::Invalid("\"{}\" lets the joints of \"{}\" move it, and \"restSkin\" does "
                                     "not: leave one of them out",
                                     other.text, mesh.name));
    }
  }
  *into_world = {item->text, AddRestSkin(in, rest, mesh, *item, graph), 0, true, {}};
  return true;
}

bool ResolveStack(const BuildInput& in, const RestPose& rest, const RigDeform& deform, std::size_t mesh_index,
                  bool any_morphs, MadeNodes* nodes, std::vector<Stage>* stages, Graph* graph) {
  const CharacterMesh& mesh = in.rig.scene.meshes[mesh_index];
  std::vector<Stage> own = OwnStages(mesh);
  if (!ChooseSkin(in, deform, mesh, rest, &own.back(), graph)) return false;
  const Stage* morph = own.front().name == "morph" ? &own.front() : nullptr;
  const Stage& into_world = own.back();  // skin or transform
  const bool placed = std::any_of(deform.stack.begin(), deform.stack.end(), [](const RigString& item) {
    return item.text == "gltf" || item.text == "skin" || item.text == "restSkin" || item.text == "transform";
  });
  bool world = false, good = true;
  const auto add_own = [&](const Stage& stage, const RigString& item) {
    for (const Stage& earlier : *stages) {
      if (earlier.node == stage.node) {
        good = in.Fail(item.where, Status::Invalid("\"{}\" brings the stage {} of \"{}\" a second time",
                                                   item.text, stage.name, mesh.name));
        return;
      }
    }
    world = world || &stage == &into_world;
    stages->push_back(stage);
    stages->back().world = world;
  };
  const auto morphed = [&] {
    return morph != nullptr && std::any_of(stages->begin(), stages->end(),
                                           [&](const Stage& stage) { return stage.node == morph->node; });
  };
  for (const RigString& item : deform.stack) {
    if (item.text == "gltf" || item.text == "morph") {
      if (morph != nullptr && world && !morphed()) {
        good =
            in.Fail(item.where,
                    Status::Invalid(
                        "\"{}\" of mesh \"{}\" moves points in mesh space, and those of \"{}\" are in world "
                        "space: put it before that stage",
                        item.text, mesh.name, stages->back().name));
      } else if (morph != nullptr) {
        add_own(*morph, item);
      }
      if (morph == nullptr && item.text == "morph" && !any_morphs) {
        good = in.Fail(item.where,
                       Status::Invalid("mesh \"{}\" has no morph targets: leave \"morph\" out", mesh.name));
      }
    }
    if (item.text == "gltf" || item.text == "skin" || item.text == "restSkin" || item.text == "transform") {
      if (item.text == "transform" && into_world.name != "transform") {
        good = in.Fail(item.where,
                       Status::Invalid("mesh \"{}\" has a skin, which ignores its transform: write \"skin\"",
                                       mesh.name));
      } else {
        add_own(into_world, item);
      }
    }
    if (item.text == "gltf" || item.text == "morph" || item.text == "skin" || item.text == "restSkin" ||
        item.text == "transform")
      continue;
    MadeNode* made = FindDeformer(in, item, nodes);
    if (made == nullptr) {
      good = false;
      continue;
    }
    // Unskinned meshes are in world space but for their morphs
    if (!world && !placed && into_world.name == "transform") add_own(into_world, item);
    const int geometry = static_cast<int>(made->geometries.size());
    good = AddGeometry(in, {mesh.name, mesh_index, mesh.mesh().point_count(), morphed()}, world, item.where,
                       made, graph) &&
           good;
    stages->push_back({item.text, made->id, geometry, world, {}});
  }
  if (!world && !placed && into_world.name == "transform")
    add_own(into_world, {into_world.name, deform.where, deform.source});
  return good;
}

void BuildMeshStack(const BuildInput& in, const RestPose& rest, const RigDeform& deform,
                    std::size_t mesh_index, bool any_morphs, MadeNodes* nodes, CharacterGraph* scene,
                    Graph* graph, std::vector<std::string>* notes) {
  std::vector<Stage> stages;
  if (!ResolveStack(in, rest, deform, mesh_index, any_morphs, nodes, &stages, graph)) return;
  CharacterMesh& mesh = scene->meshes[mesh_index];
  in.Fail(deform.where, ConnectStages(std::move(stages), &mesh, graph));
  if (!mesh.world) {
    notes->push_back(
        fmt::format("{}: the stack of \"{}\" leaves out its skin, so that its points stay in mesh space; "
                    "restSkin takes them to the world without moving them",
                    deform.where.ToString(), mesh.name));
  }
}

}  // namespace

void BuildMeshStacks(const BuildInput& in, const RestPose& rest, MadeNodes* nodes, CharacterGraph* scene,
                     Graph* graph, std::vector<std::string>* notes) {
  std::vector<std::optional<SourceLocation>> stack_of_mesh(scene->meshes.size());
  for (const RigDeform& deform : in.file.deform) {
    std::vector<std::pair<std::size_t, SourceLocation>> meshes;
    bool any_morphs = false;
    for (const RigString& name : deform.meshes) {
      const std::optional<std::size_t> mesh = in.names.FindMesh(name.text, name.where);
      if (!mesh.has_value()) continue;
      if (!IsOwn(in, in.rig.scene.meshes[*mesh].transform, name)) continue;
      if (const std::optional<SourceLocation>& first = stack_of_mesh[*mesh]; first.has_value()) {
        in.Fail(name.where,
                Status::Invalid("mesh \"{}\" has a stack already, at {}", name.text, first->ToString()));
        continue;
      }
      stack_of_mesh[*mesh] = name.where;
      any_morphs = any_morphs || in.rig.scene.meshes[*mesh].geometry.targets != nullptr;
      meshes.emplace_back(*mesh, name.where);
    }
    for (const auto& [mesh, where] : meshes)
      BuildMeshStack(in, rest, deform, mesh, any_morphs, nodes, scene, graph, notes);
  }
}

}  // namespace kpsa::engine
