// Deformer stacks: points flow stage by stage, on meshes and on points attributes.
#include <algorithm>
#include <limits>

#include "base/matrix.h"
#include "rig/build/rig_build.h"
#include "rig/build/references.h"

namespace kpsa::engine {

void RigBuild::BuildStacks() {
  // Meshes first: the box of a lattice, whose points may be deformed themselves, depends on its members
  for (const RigDeform& deform : file_->deform) {
    std::vector<std::pair<std::size_t, SourceLocation>> meshes;
    bool any_morphs = false;
    for (const RigString& name : deform.meshes) {
      const std::optional<std::size_t> mesh = FindMesh(name.text, name.where);
      if (!mesh.has_value()) continue;
      if (!IsOwn(rig_->scene.meshes[*mesh].transform, name)) continue;
      if (const std::optional<SourceLocation>& first = stack_of_mesh_[*mesh]; first.has_value()) {
        Fail(name.where,
             Status::Invalid("mesh \"{}\" has a stack already, at {}", name.text, first->ToString()));
        continue;
      }
      stack_of_mesh_[*mesh] = name.where;
      any_morphs = any_morphs || rig_->scene.meshes[*mesh].geometry.targets != nullptr;
      meshes.emplace_back(*mesh, name.where);
    }
    for (const auto& [mesh, where] : meshes) BuildMeshStack(deform, mesh, any_morphs);
  }
  for (Made& made : made_) SetWeights(&made);
  PlaceStages();
  for (const RigDeform& deform : file_->deform) {
    if (deform.points.has_value()) BuildPointsStack(deform);
  }
  ConnectFalloffs();
  for (Made& made : made_) {
    SetWeights(&made);
    const bool deforms = graph().def(made.id).FindAttribute("outPoints") >= 0 &&
                         graph().def(made.id).FindAttribute("inPoints") >= 0;
    if (deforms && made.geometries.empty()) {
      rig_->notes.push_back(fmt::format("{}: \"{}\" is in no stack and deforms nothing",
                                        made.from->where.ToString(), made.from->name));
    }
  }
}

// Stacks are those of the file that a mesh or an attribute comes from.
bool RigBuild::IsOwn(NodeId node, const RigString& name) {
  const Reference* reference = ReferenceOf(*rig_, node);
  return reference == nullptr ||
         Fail(name.where, Status::Invalid("\"{}\" belongs to a reference: its stack is what {} says",
                                          name.text, reference->file));
}

RigBuild::Made* RigBuild::FindDeformer(const RigString& name) {
  const auto deforms = [&](const Made& made) {
    const NodeDef& def = graph().def(made.id);
    const int points = def.FindAttribute("inPoints");
    return points >= 0 && def.attributes[static_cast<std::size_t>(points)].per_geometry &&
           def.FindAttribute("outPoints") >= 0;
  };
  if (Made* made = FindMade(name.text); made != nullptr) {
    if (deforms(*made)) return made;
    Fail(name.where, Status::Invalid("\"{}\" is a {}, no deformer", name.text, graph().def(made->id).name));
    return nullptr;
  }
  if (written_.count(name.text) != 0 || errors_->full()) return nullptr;  // its own error was reported
  for (const CharacterMesh& mesh : rig_->scene.meshes) {
    for (const Stage& own : OwnStages(mesh)) {
      if (graph().name(own.node) != name.text) continue;
      Fail(name.where,
           Status::Invalid("\"{}\" is the file's own: in stacks it is written \"{}\"", name.text, own.name));
      return nullptr;
    }
  }
  std::vector<std::string> names{"gltf", "morph", "skin"};
  for (const Made& made : made_) {
    if (deforms(made)) names.push_back(made.from->name);
  }
  Fail(name.where, Status::Invalid("unknown deformer \"{}\"{}", name.text, DidYouMean(name.text, names)));
  return nullptr;
}

// The next geometry of a deformer. All that one deformer serves lie before a skin or all after one.
bool RigBuild::AddGeometry(Made* made, Geometry geometry, bool world, const SourceLocation& where) {
  if (!made->geometries.empty() && made->world != world) {
    return Fail(where, Status::Invalid("\"{}\" deforms {} and {} in different spaces (before and after a "
                                       "skin): give each a deformer of its own",
                                       made->from->name, made->geometries.front().name, geometry.name));
  }
  made->world = world;
  GraphEditor edit(&graph());
  if (!world && edit.Has(made->id, "geometryMatrix")) {
    edit.Set(made->id, "geometryMatrix", static_cast<int>(made->geometries.size()),
             geometry.world_from_stage);
  }
  made->geometries.push_back(std::move(geometry));
  return Fail(where, edit.Take());
}

bool RigBuild::ResolveStack(const RigDeform& deform, std::size_t mesh_index, bool any_morphs,
                            std::vector<Stage>* stages) {
  const CharacterMesh& mesh = rig_->scene.meshes[mesh_index];
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
        good = Fail(item.where, Status::Invalid("\"{}\" brings the stage {} of \"{}\" a second time",
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
        good = Fail(item.where,
                    Status::Invalid(
                        "\"{}\" of mesh \"{}\" moves points in mesh space, and those of \"{}\" are in world "
                        "space: put it before that stage",
                        item.text, mesh.name, stages->back().name));
      } else if (morph != nullptr) {
        add_own(*morph, item);
      }
      if (morph == nullptr && item.text == "morph" && !any_morphs) {
        good = Fail(item.where,
                    Status::Invalid("mesh \"{}\" has no morph targets: leave \"morph\" out", mesh.name));
      }
    }
    if (item.text == "gltf" || item.text == "skin" || item.text == "transform") {
      if (item.text == "transform" && into_world.name == "skin") {
        good = Fail(item.where,
                    Status::Invalid("mesh \"{}\" has a skin, which ignores its transform: write \"skin\"",
                                    mesh.name));
      } else {
        add_own(into_world, item);
      }
    }
    if (item.text == "gltf" || item.text == "morph" || item.text == "skin" || item.text == "transform")
      continue;
    Made* made = FindDeformer(item);
    if (made == nullptr) {
      good = false;
      continue;
    }
    // Unskinned meshes are in world space but for their morphs
    if (!world && !placed && into_world.name == "transform") add_own(into_world, item);
    const int geometry = static_cast<int>(made->geometries.size());
    good =
        AddGeometry(made, {mesh.name, mesh_index, mesh.mesh().point_count(), morphed()}, world, item.where) &&
        good;
    stages->push_back({item.text, made->id, geometry, world, {}});
  }
  if (!world && !placed && into_world.name == "transform")
    add_own(into_world, {into_world.name, deform.where, deform.source});
  return good;
}

void RigBuild::BuildMeshStack(const RigDeform& deform, std::size_t mesh_index, bool any_morphs) {
  std::vector<Stage> stages;
  if (!ResolveStack(deform, mesh_index, any_morphs, &stages)) return;
  CharacterMesh& mesh = rig_->scene.meshes[mesh_index];
  Fail(deform.where, ConnectStages(std::move(stages), &mesh, &graph()));
  if (!mesh.world) {
    rig_->notes.push_back(
        fmt::format("{}: the stack of \"{}\" leaves out its skin, so that its points stay in mesh space",
                    deform.where.ToString(), mesh.name));
  }
}

// {points: cage.points, stack: [cluster1]}: the deformers get the attribute's own value and drive it.
void RigBuild::BuildPointsStack(const RigDeform& deform) {
  const RigString& name = *deform.points;
  const Result<PlugRef> plug = graph().FindPlug(name.text);
  if (!Fail(name.where, plug.status()) || !IsOwn(plug->node, name)) return;
  const AttributeDef& attribute =
      graph().def(plug->node).attributes[static_cast<std::size_t>(plug->attribute)];
  if (graph().PlugType(*plug) != Type::kPoints || attribute.output) {
    Fail(name.where,
         Status::Invalid("{} is no points input, so it cannot be deformed", graph().PlugName(*plug)));
    return;
  }
  Matrix4 world_from_points;
  const PointBufferPtr points = PointsToDeform(*plug, name, &world_from_points);
  if (points == nullptr) return;
  std::optional<PlugRef> last;
  for (const RigString& item : deform.stack) {
    for (const char* word : {"gltf", "morph", "skin", "transform"}) {
      if (item.text == word)
        Fail(item.where, Status::Invalid("\"{}\" belongs to meshes, not to {}", word, name.text));
    }
    Made* made = FindDeformer(item);
    const std::string type = made == nullptr ? "" : graph().def(made->id).name;
    if (type == "deltaMush" || type == "tension") {
      Fail(item.where, Status::Invalid("\"{}\" {} the edges of a mesh, and {} has none", item.text,
                                       type == "tension" ? "measures" : "smooths along", name.text));
      return;
    }
    const int geometry = made == nullptr ? 0 : static_cast<int>(made->geometries.size());
    if (made == nullptr ||
        !AddGeometry(made, {name.text, std::nullopt, points->count(), true, world_from_points}, false,
                     item.where))
      return;
    GraphEditor edit(&graph());
    if (edit.Has(made->id, "space")) edit.Set(made->id, "space", Value("mesh"));
    if (last.has_value()) {
      edit.Connect(*last, edit.Plug(made->id, "inPoints", geometry));
    } else {
      edit.Set(made->id, "inPoints", geometry, Value(points));
    }
    last = edit.Plug(made->id, "outPoints", geometry);
    if (!Fail(item.where, edit.Take())) return;
  }
  if (!last.has_value()) return;
  stacked_.insert(KeyOf(*plug));
  Fail(name.where, graph().Connect(*last, *plug));
}

// The value that a points attribute has without its stack. Lattice points are in the coordinates of the
// lattice's box.
PointBufferPtr RigBuild::PointsToDeform(const PlugRef& plug, const RigString& name,
                                        Matrix4* world_from_points) {
  const AttributeDef& attribute = graph().def(plug.node).attributes[static_cast<std::size_t>(plug.attribute)];
  const Value* set = graph().FindValue(plug);
  PointBufferPtr points;
  if (set != nullptr && set->points() != nullptr) points = set->get<PointBufferPtr>();
  if (!attribute.grid.empty()) {
    Made* lattice = FindMade(plug.node);
    if (lattice == nullptr || !BoxOfMembers(lattice, name.where, world_from_points)) return nullptr;
    if (points == nullptr) points = RegularGrid(plug, name);
    if (points == nullptr) return nullptr;
  } else if (const auto curve = curves_.find(plug.node.index); points == nullptr && curve != curves_.end()) {
    points = std::make_shared<const PointBuffer>(curve->second.size());  // offsets of its vertices
  }
  if (points == nullptr) {
    Fail(name.where, Status::Invalid("{} has no points to deform: set them first", name.text));
    return nullptr;
  }
  // Single points that are set, too, go into the stack
  std::shared_ptr<PointBuffer> changed;
  for (const SetValue& single : graph().Values(plug.node, plug.attribute)) {
    if (single.plug.element < 0) continue;
    if (static_cast<std::size_t>(single.plug.element) >= points->count()) {
      Fail(name.where, Status::Invalid("{}: {} is set, but there are {} points", name.text,
                                       graph().PlugName(single.plug), points->count()));
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

// The control points of a lattice at rest.
PointBufferPtr RigBuild::RegularGrid(const PlugRef& plug, const RigString& name) {
  const NodeDef& def = graph().def(plug.node);
  const AttributeDef& attribute = def.attributes[static_cast<std::size_t>(plug.attribute)];
  const int number = def.FindAttribute(attribute.grid);
  const Value* divisions_set = graph().FindValue({plug.node, number, -1, -1});
  const Value& divisions = divisions_set != nullptr
                               ? *divisions_set
                               : def.attributes[static_cast<std::size_t>(number)].default_value;
  const auto* sizes = divisions.get_if<std::vector<std::int64_t>>();
  constexpr std::int64_t kMaxDivisions = 32;
  if (sizes == nullptr || sizes->size() != 3 ||
      std::any_of(sizes->begin(), sizes->end(), [](std::int64_t n) { return n < 2 || n > kMaxDivisions; })) {
    Fail(name.where, Status::Invalid("{}: the divisions {} are not three whole numbers from 2 to {}",
                                     name.text, divisions.ToString(), kMaxDivisions));
    return nullptr;
  }
  std::vector<float> grid;
  for (std::int64_t u = 0; u < (*sizes)[2]; ++u) {
    for (std::int64_t t = 0; t < (*sizes)[1]; ++t) {
      for (std::int64_t s = 0; s < (*sizes)[0]; ++s) {
        const std::int64_t at[3] = {s, t, u};
        for (std::size_t i = 0; i < 3; ++i) {
          grid.push_back(
              static_cast<float>(static_cast<double>(at[i]) / static_cast<double>((*sizes)[i] - 1)));
        }
      }
    }
  }
  return std::make_shared<const PointBuffer>(PointBuffer::FromInterleaved(grid));
}

}  // namespace kpsa::engine
