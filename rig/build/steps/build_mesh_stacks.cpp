#include "rig/build/steps/build_mesh_stacks.h"

#include <algorithm>

#include "rig/build/stack_parts.h"
#include "rig/graph_editor.h"

namespace kpsa::engine {
namespace {

bool ResolveStack(const BuildInput& in, const RigDeform& deform, std::size_t mesh_index, bool any_morphs,
                  MadeNodes* nodes, std::vector<Stage>* stages, Graph* graph) {
  const CharacterMesh& mesh = in.rig.scene.meshes[mesh_index];
  std::vector<Stage> own = OwnStages(mesh);
  const Stage* morph = own.front().name == "morph" ? &own.front() : nullptr;
  const Stage& into_world = own.back();  // skin or transform
  const bool placed = std::any_of(deform.stack.begin(), deform.stack.end(), [](const RigString& item) {
    return item.text == "gltf" || item.text == "skin" || item.text == "transform";
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
    if (item.text == "gltf" || item.text == "skin" || item.text == "transform") {
      if (item.text == "transform" && into_world.name == "skin") {
        good = in.Fail(item.where,
                       Status::Invalid("mesh \"{}\" has a skin, which ignores its transform: write \"skin\"",
                                       mesh.name));
      } else {
        add_own(into_world, item);
      }
    }
    if (item.text == "gltf" || item.text == "morph" || item.text == "skin" || item.text == "transform")
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

void BuildMeshStack(const BuildInput& in, const RigDeform& deform, std::size_t mesh_index, bool any_morphs,
                    MadeNodes* nodes, CharacterGraph* scene, Graph* graph, std::vector<std::string>* notes) {
  std::vector<Stage> stages;
  if (!ResolveStack(in, deform, mesh_index, any_morphs, nodes, &stages, graph)) return;
  CharacterMesh& mesh = scene->meshes[mesh_index];
  in.Fail(deform.where, ConnectStages(std::move(stages), &mesh, graph));
  if (!mesh.world) {
    notes->push_back(
        fmt::format("{}: the stack of \"{}\" leaves out its skin, so that its points stay in mesh space",
                    deform.where.ToString(), mesh.name));
  }
}

}  // namespace

void BuildMeshStacks(const BuildInput& in, MadeNodes* nodes, CharacterGraph* scene, Graph* graph,
                     std::vector<std::string>* notes) {
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
      BuildMeshStack(in, deform, mesh, any_morphs, nodes, scene, graph, notes);
  }
}

}  // namespace kpsa::engine
