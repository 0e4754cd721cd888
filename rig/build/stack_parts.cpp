#include "rig/build/stack_parts.h"

#include "rig/build/references.h"
#include "rig/graph_editor.h"

namespace kpsa::engine {

bool IsOwn(const BuildInput& in, NodeId node, const RigString& name) {
  const Reference* reference = ReferenceOf(in.rig, node);
  return reference == nullptr ||
         in.Fail(name.where, Status::Invalid("\"{}\" belongs to a reference: its stack is what {} says",
                                             name.text, reference->file));
}

MadeNode* FindDeformer(const BuildInput& in, const RigString& name, MadeNodes* nodes) {
  const auto deforms = [&](const MadeNode& made) {
    const NodeDef& def = in.graph().def(made.id);
    const int points = def.FindAttribute("inPoints");
    return points >= 0 && def.attributes[static_cast<std::size_t>(points)].per_geometry &&
           def.FindAttribute("outPoints") >= 0;
  };
  if (MadeNode* made = nodes->Find(name.text); made != nullptr) {
    if (deforms(*made)) return made;
    in.Fail(name.where,
            Status::Invalid("\"{}\" is a {}, no deformer", name.text, in.graph().def(made->id).name));
    return nullptr;
  }
  if (in.names.IsWritten(name.text) || in.errors->full()) return nullptr;  // its own error was reported
  for (const CharacterMesh& mesh : in.rig.scene.meshes) {
    for (const Stage& own : OwnStages(mesh)) {
      if (in.graph().name(own.node) != name.text) continue;
      in.Fail(name.where, Status::Invalid("\"{}\" is the file's own: in stacks it is written \"{}\"",
                                          name.text, own.name));
      return nullptr;
    }
  }
  std::vector<std::string> names{"gltf", "morph", "skin", "restSkin"};
  for (const MadeNode& made : *nodes) {
    if (deforms(made)) names.push_back(made.from->name);
  }
  Suggestion meant = DidYouMean(name.text, names);
  meant.otherwise = "; expected a deformer of \"nodes\", or gltf, morph, skin or restSkin";
  in.Fail(name.where, Status::Invalid("unknown deformer \"{}\"{}", name.text, meant));
  return nullptr;
}

bool AddGeometry(const BuildInput& in, DeformedGeometry geometry, bool world, const SourceLocation& where,
                 MadeNode* made, Graph* graph) {
  if (!made->geometries.empty() && made->world != world) {
    return in.Fail(where, Status::Invalid("\"{}\" deforms {} and {} in different spaces (before and after a "
                                          "skin): give each a deformer of its own",
                                          made->from->name, made->geometries.front().name, geometry.name));
  }
  made->world = world;
  GraphEditor edit(graph);
  if (!world && edit.Has(made->id, "geometryMatrix")) {
    edit.Set(made->id, "geometryMatrix", static_cast<int>(made->geometries.size()),
             geometry.world_from_stage);
  }
  made->geometries.push_back(std::move(geometry));
  return in.Fail(where, edit.Take());
}

void SetWorldFromStage(const BuildInput& in, std::size_t geometry, const Matrix4& world_from_stage,
                       MadeNode* made, Graph* graph) {
  made->geometries[geometry].world_from_stage = world_from_stage;
  GraphEditor edit(graph);
  if (!edit.Has(made->id, "geometryMatrix")) return;
  edit.Set(made->id, "geometryMatrix", static_cast<int>(geometry), world_from_stage);
  in.Fail(made->from->where, edit.Take());
}

const WeightMap* WeightsOf(const MadeNode& made, std::size_t geometry, Graph* graph) {
  GraphEditor edit(graph);
  const Value* map = graph->FindValue(edit.Plug(made.id, "weights", static_cast<int>(geometry)));
  return map == nullptr ? nullptr : map->asset<WeightMap>();
}

}  // namespace kpsa::engine
