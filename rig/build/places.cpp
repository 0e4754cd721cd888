// Where the rig's own nodes are at rest: curves through vertices, parents, and handles that are placed `at`
// something.
#include <cmath>

#include "base/matrix.h"
#include "rig/build/rig_build.h"
#include "rig/build/references.h"

namespace kpsa::engine {
namespace {

constexpr int kMaxDepth = 1000;
constexpr std::size_t kMaxCvs = 65536;

// A set double3 or enum of a transform, components merged, or the default.
Double3 SetDouble3(const Graph& graph, NodeId node, const char* name, Double3 fallback) {
  const int attribute = graph.def(node).FindAttribute(name);
  if (attribute < 0) return fallback;
  Double3 result = fallback;
  if (const Value* whole = graph.FindValue({node, attribute, -1, -1})) result = whole->get<Double3>();
  for (int i = 0; i < 3; ++i) {
    if (const Value* component = graph.FindValue({node, attribute, -1, i})) result[i] = component->AsDouble();
  }
  return result;
}

}  // namespace

void RigBuild::AddCurves() {
  for (Made& made : made_) {
    if (graph().def(made.id).name != "curve" || errors_->full()) continue;
    const auto find = [&](const char* key) {
      return made.special.count(key) != 0 ? made.special[key] : nullptr;
    };
    const RigAttribute* vertices = find("vertices");
    const RigAttribute* places = find("places");
    const RigAttribute* mesh = find("mesh");
    const RigAttribute* closed = find("closed");
    if ((vertices == nullptr) == (places == nullptr)) {
      Fail(made.from->where,
           Status::Invalid(
               "curve \"{}\": expected either \"vertices\" of a mesh or \"places\" [[x, y, z], ...]",
               made.from->name));
      continue;
    }
    Places cvs;
    bool is_closed = false;
    if (closed != nullptr && !ReadBool(closed->value, "closed", &is_closed, errors_)) continue;
    if (vertices != nullptr) {
      if (!VertexPlaces(vertices->value, mesh == nullptr ? nullptr : &mesh->value, &cvs)) continue;
    } else {
      bool good =
          places->value.is_sequence() || errors_->Add(places->value, "places: expected a list of points");
      for (const YamlNode& item : places->value.items) {
        std::vector<double> p;
        good = ReadNumbers(item, "places", Unit::kLength, units(places->source), 3, &p, errors_) && good;
        if (good) cvs.push_back({p[0], p[1], p[2]});
      }
      if (!good) continue;
    }
    const std::size_t fewest = is_closed ? 3 : 2;
    if (cvs.size() < fewest || cvs.size() > kMaxCvs) {
      Fail(made.from->where,
           Status::Invalid("{}curve \"{}\" has {} points; expected {} to {}", is_closed ? "closed " : "",
                           made.from->name, cvs.size(), fewest, kMaxCvs));
      continue;
    }
    GraphEditor edit(&graph());
    edit.Set(made.id, "curve", std::make_shared<const Curve>(cvs, is_closed));
    Fail(made.from->where, edit.Take());
    curves_[made.id.index] = std::move(cvs);
  }
}

// World places at rest of vertices of a mesh (of the only one, where none is named).
bool RigBuild::VertexPlaces(const YamlNode& vertices, const YamlNode* mesh_node, Places* places) {
  std::size_t mesh = 0;
  if (mesh_node != nullptr) {
    std::string name;
    if (!ReadString(*mesh_node, "mesh", &name, errors_)) return false;
    const std::optional<std::size_t> found = FindMesh(name, mesh_node->where());
    if (!found.has_value()) return false;
    mesh = *found;
  } else if (rig_->scene.meshes.size() != 1) {
    return errors_->Add(vertices,
                        "the character has {} meshes: name the one that the vertices are of, \"mesh: NAME\"",
                        rig_->scene.meshes.size());
  }
  const CharacterMesh& of = rig_->scene.meshes[mesh];
  std::vector<Index> list;
  if (!ReadVertices(vertices, of.vertex_count, of.name, &list)) return false;
  const Places& points = rest_->WorldPoints(mesh);
  places->clear();
  for (Index v : list) places->push_back(points[of.mesh().data().vertex_to_point[v]]);
  return true;
}

void RigBuild::ConnectParents() {
  for (Made& made : made_) {
    const auto it = made.special.find("parent");
    if (it == made.special.end() || errors_->full()) continue;
    std::string name;
    if (!ReadString(it->second->value, "parent", &name, errors_)) continue;
    const std::optional<NodeId> parent = FindTransform(name, it->second->value.where());
    if (!parent.has_value()) continue;
    GraphEditor edit(&graph());
    edit.Connect(edit.Plug(*parent, "worldMatrix"), edit.Plug(made.id, "parentMatrix"));
    Fail(it->second->value.where(), edit.Take());
  }
}

// The frame of a deltaMush or tension in world space says only about which place it computes and how large
// the character is; where the rig names none, it is that which carries the mesh.
void RigBuild::ConnectPivots() {
  for (const Made& made : made_) {
    const std::string& type = graph().def(made.id).name;
    if ((type != "deltaMush" && type != "tension") || !made.world || made.geometries.empty()) continue;
    GraphEditor edit(&graph());
    const PlugRef parent = edit.Plug(made.id, "parentMatrix");
    if (!edit.ok() || graph().FindValue(parent) != nullptr || graph().FindConnection(parent) != nullptr)
      continue;
    const std::optional<NodeId> ancestor = CommonAncestor(made);
    // A transform that depends on the points cannot carry them
    if (ancestor.has_value()) (void)graph().Connect(edit.Plug(*ancestor, "worldMatrix"), parent).ok();
  }
}

// The deepest glTF node above all joints that move the deformer's meshes (and above meshes without a skin),
// that is not scaled to nothing at rest.
std::optional<NodeId> RigBuild::CommonAncestor(const Made& made) const {
  const gltf::Character& character = *rig_->character;
  std::vector<bool> carries(character.nodes.size(), false);
  for (const Geometry& geometry : made.geometries) {
    if (!geometry.mesh.has_value()) continue;
    const CharacterMesh& mesh = rig_->scene.meshes[*geometry.mesh];
    if (mesh.influences == nullptr) {
      carries[mesh.gltf_node] = true;
      continue;
    }
    for (std::size_t i = 0; i < mesh.influences->joints().size(); ++i) {
      if (mesh.influences->weights()[i] > 0)
        carries[gltf_by_node_.at(mesh.influence_nodes[mesh.influences->joints()[i]].index)] = true;
    }
  }
  std::vector<std::size_t> below(carries.size(), 0);  // carriers at a node and below it
  std::size_t total = 0;
  for (auto it = character.order.rbegin(); it != character.order.rend(); ++it) {  // children first
    if (carries[*it]) ++below[*it], ++total;
    const Index parent = character.nodes[*it].parent;
    if (parent != kNoIndex) below[parent] += below[*it];
  }
  std::optional<NodeId> deepest;
  for (Index node : character.order) {  // parents first: the last one is the deepest
    Matrix4 inverse;
    if (total > 0 && below[node] == total && Invert(rest_->NodeWorld(node), &inverse))
      deepest = rig_->scene.transforms[node];
  }
  return deepest;
}

void RigBuild::PlaceHandles() {
  for (Made& made : made_) {
    if (graph().def(made.id).FindAttribute("offsetParentMatrix") < 0) continue;
    if (!Place(&made, 0)) continue;
    GraphEditor edit(&graph());
    if (!edit.Has(made.id, "restMatrix")) continue;
    const Value* offset = graph().FindValue(edit.Plug(made.id, "offsetParentMatrix"));
    if (offset != nullptr && graph().FindValue(edit.Plug(made.id, "restMatrix")) == nullptr)
      edit.Set(made.id, "restMatrix", *offset);
    Fail(made.from->where, edit.Take());
  }
}

// Follows `at`: sets offsetParentMatrix so that translate 0 is at the place. The axes stay the parent's.
bool RigBuild::Place(Made* made, int depth) {
  if (made->placed) return true;
  const auto it = made->special.find("at");
  if (it == made->special.end()) {
    made->placed = true;
    return true;
  }
  const YamlNode& at = it->second->value;
  if (made->placing || depth > kMaxDepth) {
    return errors_->Add(at, "\"{}\" {}", made->from->name,
                        made->placing ? "is placed at something that is placed at it"
                                      : "is placed at the end of too long a chain");
  }
  GraphEditor edit(&graph());
  const PlugRef offset = edit.Plug(made->id, "offsetParentMatrix");
  made->placed = true;  // reported once, whatever comes
  if (graph().FindValue(offset) != nullptr)
    return errors_->Add(at, "\"{}\": either \"at\" or offsetParentMatrix, not both", made->from->name);
  made->placing = true;
  made->placed = false;
  Double3 place;
  Matrix4 parent, inverse;
  bool good = ReadPlace(at, it->second->source, depth + 1, &place);
  if (good) good = HangUnderReference(*made, at);
  if (const Connection* connection = graph().FindConnection(edit.Plug(made->id, "parentMatrix"));
      good && connection != nullptr) {
    good = RestWorld(connection->source.node, at, depth + 1, &parent);
  }
  made->placing = false;
  made->placed = true;
  if (!good) return false;
  if (!Invert(parent, &inverse))
    return errors_->Add(at, "\"{}\": its parent is scaled to nothing at rest", made->from->name);
  edit.Set(made->id, "offsetParentMatrix", Translation(TransformPoint(inverse, place)));
  return Fail(at.where(), edit.Take());
}

// A handle at a place of a referenced character, of which nothing says what carries it, goes along with that
// character.
bool RigBuild::HangUnderReference(const Made& made, const YamlNode& at) {
  GraphEditor edit(&graph());
  const PlugRef parent = edit.Plug(made.id, "parentMatrix");
  if (graph().FindConnection(parent) != nullptr || graph().FindValue(parent) != nullptr) return true;
  std::optional<NodeId> of;
  if (at.is_scalar()) {
    if (const Result<NodeId> node = graph().FindNode(at.scalar); node.ok()) of = *node;
  } else if (const YamlNode* mesh = at.is_map() ? at.Find("mesh") : nullptr) {
    if (const auto found = FindMesh(mesh->scalar, mesh->where())) of = rig_->scene.meshes[*found].transform;
  }
  const Reference* reference = of.has_value() ? ReferenceOf(*rig_, *of) : nullptr;
  if (reference == nullptr) return true;
  edit.Connect(edit.Plug(reference->root, "worldMatrix"), parent);
  return Fail(at.where(), edit.Take());
}

Matrix4 RigBuild::LocalAtRest(NodeId node) const {
  if (IsReferenceRoot(*rig_, node)) return Matrix4();
  const int offset = graph().def(node).FindAttribute("offsetParentMatrix");
  const int order = graph().def(node).FindAttribute("rotateOrder");
  Matrix4 local;
  if (const Value* set = offset < 0 ? nullptr : graph().FindValue({node, offset, -1, -1}))
    local = set->get<Matrix4>();
  const Value* order_value = order < 0 ? nullptr : graph().FindValue({node, order, -1, -1});
  const RotateOrder rotate_order =
      order_value == nullptr ? RotateOrder::kXyz : static_cast<RotateOrder>(order_value->AsInt());
  return local * Translation(SetDouble3(graph(), node, "translate", {})) *
         RotationFromEuler(SetDouble3(graph(), node, "rotate", {}), rotate_order) *
         Scaling(SetDouble3(graph(), node, "scale", {1, 1, 1}));
}

// world_from_local of a transform with everything as set and no connection followed but its parent's.
bool RigBuild::RestWorld(NodeId transform, const YamlNode& asked, int depth, Matrix4* world) {
  *world = Matrix4();
  for (NodeId node = transform;; ++depth) {
    if (depth > kMaxDepth) return errors_->Add(asked, "places depend on each other too deeply");
    const auto it = gltf_by_node_.find(node.index);
    if (it != gltf_by_node_.end()) {
      *world = rest_->NodeWorld(it->second) * *world;
      return true;
    }
    Made* made = FindMade(node);
    if (made != nullptr && !Place(made, depth + 1)) return false;
    *world = LocalAtRest(node) * *world;
    const int parent = graph().def(node).FindAttribute("parentMatrix");
    const Connection* connection = parent < 0 ? nullptr : graph().FindConnection({node, parent, -1, -1});
    if (connection == nullptr) return true;
    node = connection->source.node;
  }
}

// A place in the world at rest: a curve (its middle cv), a cv (`lips[2]`), a transform, {vertex: 812, mesh:
// NAME} or [x, y, z].
bool RigBuild::ReadPlace(const YamlNode& node, int source, int depth, Double3* place) {
  if (node.is_sequence()) {
    std::vector<double> p;
    if (!ReadNumbers(node, "place", Unit::kLength, units(source), 3, &p, errors_)) return false;
    *place = {p[0], p[1], p[2]};
    return true;
  }
  if (node.is_map()) {
    YamlMap map(node, "place", errors_);
    const YamlNode* vertex = map.Required("vertex");
    const YamlNode* mesh = map.Find("mesh");
    map.RejectUnread();
    Places places;
    if (vertex == nullptr || !VertexPlaces(*vertex, mesh, &places)) return false;
    if (places.size() != 1)
      return errors_->Add(*vertex, "place: expected one vertex, found {}", places.size());
    *place = places[0];
    return true;
  }
  std::string name;
  if (!ReadString(node, "place", &name, errors_)) return false;
  const auto curve_of = [&](const std::string& curve) -> const Places* {
    const Made* made = FindMade(curve);
    const auto it = made == nullptr ? curves_.end() : curves_.find(made->id.index);
    return it == curves_.end() ? nullptr : &it->second;
  };
  if (const Places* cvs = curve_of(name)) {
    *place = (*cvs)[cvs->size() / 2];
    return true;
  }
  if (const std::size_t open = name.rfind('['); open != std::string::npos && name.back() == ']') {
    std::string curve = name.substr(0, open);
    if (curve.size() > 3 && curve.compare(curve.size() - 3, 3, ".cv") == 0) curve.resize(curve.size() - 3);
    if (const Places* cvs = curve_of(curve)) {
      const Result<double> index =
          ParseQuantity(name.substr(open + 1, name.size() - open - 2), Unit::kNone, FileUnits());
      if (!index.ok() || *index < 0 || *index != std::floor(*index) ||
          *index >= static_cast<double>(cvs->size())) {
        return errors_->Add(node, "\"{}\": curve \"{}\" has cvs 0 to {}", name, curve, cvs->size() - 1);
      }
      *place = (*cvs)[static_cast<std::size_t>(*index)];
      return true;
    }
  }
  const std::optional<NodeId> transform = FindTransform(name, node.where());
  Matrix4 world;
  if (!transform.has_value() || !RestWorld(*transform, node, depth, &world)) return false;
  *place = {world(0, 3), world(1, 3), world(2, 3)};
  return true;
}

}  // namespace kpsa::engine
