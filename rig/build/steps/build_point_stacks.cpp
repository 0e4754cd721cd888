#include "rig/build/steps/build_point_stacks.h"

#include <memory>

#include "rig/build/stack_parts.h"
#include "rig/graph_editor.h"

namespace kpsa::engine {
namespace {

// The value that a points attribute has without its stack. Lattice points are in the coordinates of the
// lattice's box.
PointBufferPtr PointsToDeform(const BuildInput& in, const PlugRef& plug, const RigString& name,
                              const RestCurves& curves, RestPose* rest, MadeNodes* nodes, Graph* graph,
                              Matrix4* world_from_points) {
  const AttributeDef& attribute = graph->def(plug.node).attributes[static_cast<std::size_t>(plug.attribute)];
  const Value* set = graph->FindValue(plug);
  PointBufferPtr points;
  if (set != nullptr && set->points() != nullptr) points = set->get<PointBufferPtr>();
  if (!attribute.grid.empty()) {
    MadeNode* lattice = nodes->Find(plug.node);
    if (lattice == nullptr || !BoxOfMembers(in, name.where, rest, lattice, graph, world_from_points))
      return nullptr;
    if (points == nullptr) points = RegularGrid(in, plug, name);
    if (points == nullptr) return nullptr;
  } else if (const auto curve = curves.find(plug.node.index); points == nullptr && curve != curves.end()) {
    points = std::make_shared<const PointBuffer>(curve->second.size());  // offsets of its vertices
  }
  if (points == nullptr) {
    in.Fail(name.where, Status::Invalid("{} has no points to deform: set them first", name.text));
    return nullptr;
  }
  // Single points that are set, too, go into the stack
  std::shared_ptr<PointBuffer> changed;
  for (const SetValue& single : graph->Values(plug.node, plug.attribute)) {
    if (single.plug.element < 0) continue;
    if (static_cast<std::size_t>(single.plug.element) >= points->count()) {
      in.Fail(name.where, Status::Invalid("{}: {} is set, but there are {} points", name.text,
                                          graph->PlugName(single.plug), points->count()));
      return nullptr;
    }
    if (changed == nullptr)
      changed = std::make_shared<PointBuffer>(PointBuffer::FromInterleaved(points->Interleaved()));
    float* rows[3] = {changed->view().x, changed->view().y, changed->view().z};
    for (int i = 0; i < 3; ++i) {
      if (single.plug.component >= 0 && single.plug.component != i) continue;
      const double value =
          single.plug.component >= 0 ? single.value.AsDouble() : single.value.get<Double3>()[i];
      rows[i][single.plug.element] = static_cast<float>(value);
    }
  }
  return changed == nullptr ? points : changed;
}

// {points: cage.points, stack: [cluster1]}: the deformers get the attribute's own value and drive it.
void BuildPointStack(const BuildInput& in, const RigDeform& deform, const RestCurves& curves, RestPose* rest,
                     MadeNodes* nodes, PlugKeys* stacked, Graph* graph) {
  const RigString& name = *deform.points;
  const Result<PlugRef> plug = graph->FindPlug(name.text);
  if (!in.Fail(name.where, plug.status()) || !IsOwn(in, plug->node, name)) return;
  const AttributeDef& attribute =
      graph->def(plug->node).attributes[static_cast<std::size_t>(plug->attribute)];
  if (graph->PlugType(*plug) != Type::kPoints || attribute.output) {
    in.Fail(name.where,
            Status::Invalid("{} is no points input, so it cannot be deformed", graph->PlugName(*plug)));
    return;
  }
  Matrix4 world_from_points;
  const PointBufferPtr points =
      PointsToDeform(in, *plug, name, curves, rest, nodes, graph, &world_from_points);
  if (points == nullptr) return;
  std::optional<PlugRef> last;
  for (const RigString& item : deform.stack) {
    for (const char* word : {"gltf", "morph", "skin", "restSkin", "transform"}) {
      if (item.text == word)
        in.Fail(item.where, Status::Invalid("\"{}\" belongs to meshes, not to {}", word, name.text));
    }
    MadeNode* made = FindDeformer(in, item, nodes);
    const std::string type = made == nullptr ? "" : graph->def(made->id).name;
    if (type == "deltaMush" || type == "tension") {
      in.Fail(item.where, Status::Invalid("\"{}\" {} the edges of a mesh, and {} has none", item.text,
                                          type == "tension" ? "measures" : "smooths along", name.text));
      return;
    }
    const int geometry = made == nullptr ? 0 : static_cast<int>(made->geometries.size());
    if (made == nullptr ||
        !AddGeometry(in, {name.text, std::nullopt, points->count(), true, world_from_points}, false,
                     item.where, made, graph))
      return;
    GraphEditor edit(graph);
    if (edit.Has(made->id, "space")) edit.Set(made->id, "space", Value("mesh"));
    if (last.has_value()) {
      edit.Connect(*last, edit.Plug(made->id, "inPoints", geometry));
    } else {
      edit.Set(made->id, "inPoints", geometry, Value(points));
    }
    last = edit.Plug(made->id, "outPoints", geometry);
    if (!in.Fail(item.where, edit.Take())) return;
  }
  if (!last.has_value()) return;
  stacked->insert(KeyOf(*plug));
  in.Fail(name.where, graph->Connect(*last, *plug));
}

}  // namespace

void BuildPointStacks(const BuildInput& in, const RestCurves& curves, RestPose* rest, MadeNodes* nodes,
                      PlugKeys* stacked, Graph* graph) {
  for (const RigDeform& deform : in.file.deform) {
    if (deform.points.has_value()) BuildPointStack(in, deform, curves, rest, nodes, stacked, graph);
  }
}

}  // namespace kpsa::engine
