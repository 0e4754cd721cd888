#include "report/page_fields.h"

#include <algorithm>
#include <unordered_set>

#include "report/page_rig.h"
#include "rig/build/deformer_weights.h"

namespace kpsa::engine {
namespace {

constexpr std::string_view kJoint = "joint:", kDeformer = "deformer:";

bool IsDeformer(const Rig& rig, const CharacterMesh& mesh, const Stage& stage) {
  return stage.node != mesh.skin_cluster && stage.name != "morph" && stage.name != "transform" &&
         rig.graph->def(stage.node).FindAttribute("weights") >= 0;
}

// By point of the mesh; false where it has no such joint.
bool AddJoint(const CharacterMesh& mesh, const Graph& graph, std::string_view joint,
              std::vector<float>* weights) {
  bool found = false;
  for (std::size_t j = 0; j < mesh.influence_nodes.size(); ++j) {
    if (graph.name(mesh.influence_nodes[j]) != joint) continue;
    found = true;
    for (Index point = 0; point < mesh.mesh().point_count(); ++point) {
      for (Index i = mesh.influences->offsets()[point]; i < mesh.influences->offsets()[point + 1]; ++i) {
        if (mesh.influences->joints()[i] == j) (*weights)[point] += mesh.influences->weights()[i];
      }
    }
  }
  return found;
}

// The same of a deformer, which may be in a stack several times.
bool AddDeformer(const Rig& rig, const CharacterMesh& mesh, std::string_view deformer,
                 std::vector<float>* weights) {
  bool found = false;
  for (const Stage& stage : mesh.stages) {
    if (!IsDeformer(rig, mesh, stage) || rig.graph->name(stage.node) != deformer) continue;
    found = true;
    const std::vector<float> own = PointWeights(rig, {&mesh, &stage});
    for (std::size_t i = 0; i < std::min(own.size(), weights->size()); ++i)
      (*weights)[i] = std::max((*weights)[i], own[i]);
  }
  return found;
}

}  // namespace

std::vector<PageField> FieldsOf(const Rig& rig) {
  std::vector<PageField> fields;
  std::unordered_set<std::string> known;
  const auto add = [&](std::string_view kind, const char* group, const std::string& label) {
    if (known.insert(std::string(kind) + label).second)
      fields.push_back({std::string(kind) + label, group, label});
  };
  const std::vector<std::size_t> shown = ShownMeshes(rig.scene);
  for (const std::size_t m : shown) {
    for (const NodeId joint : rig.scene.meshes[m].influence_nodes)
      add(kJoint, "joints", rig.graph->name(joint));
  }
  for (const std::size_t m : shown) {
    for (const Stage& stage : rig.scene.meshes[m].stages) {
      if (IsDeformer(rig, rig.scene.meshes[m], stage))
        add(kDeformer, "deformers", rig.graph->name(stage.node));
    }
  }
  return fields;
}

std::optional<std::vector<float>> FieldWeights(const Rig& rig, std::string_view name) {
  const bool joint = name.starts_with(kJoint);
  if (!joint && !name.starts_with(kDeformer)) return std::nullopt;
  const std::string_view label = name.substr(joint ? kJoint.size() : kDeformer.size());
  bool found = false;
  std::vector<float> field;
  for (const std::size_t m : ShownMeshes(rig.scene)) {
    const CharacterMesh& mesh = rig.scene.meshes[m];
    std::vector<float> points(mesh.mesh().point_count(), 0.0f);
    const bool has = joint ? mesh.influences != nullptr && AddJoint(mesh, *rig.graph, label, &points)
                           : AddDeformer(rig, mesh, label, &points);
    found = found || has;
    const std::vector<Index>& point_of = mesh.mesh().data().vertex_to_point;
    for (Index vertex = 0; vertex < mesh.vertex_count; ++vertex)
      field.push_back(std::clamp(points[point_of[vertex]], 0.0f, 1.0f));
  }
  if (!found) return std::nullopt;
  return field;
}

void PutFields(const Rig& rig, PageData* page) {
  std::string fields;
  for (const PageField& field : FieldsOf(rig)) {
    fields += fields.empty() ? "[" : ",";
    fields += "{\"name\":" + PageText(field.name) + ",\"group\":" + PageText(field.group) +
              ",\"label\":" + PageText(field.label) + "}";
  }
  if (!fields.empty()) page->Put("fields", fields + "]");
}

}  // namespace kpsa::engine
