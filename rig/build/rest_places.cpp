#include "rig/build/rest_places.h"

#include <cmath>

#include "base/matrix.h"
#include "rig/build/references.h"
#include "rig/build/vertices.h"
#include "rig/file/values.h"
#include "rig/graph_editor.h"

namespace kpsa::engine {
namespace {

constexpr int kMaxPlaceDepth = 1000;

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

Matrix4 LocalAtRest(const Rig& rig, NodeId node) {
  if (IsReferenceRoot(rig, node)) return Matrix4();
  const Graph& graph = *rig.graph;
  const int offset = graph.def(node).FindAttribute("offsetParentMatrix");
  const int order = graph.def(node).FindAttribute("rotateOrder");
  Matrix4 local;
  if (const Value* set = offset < 0 ? nullptr : graph.FindValue({node, offset, -1, -1}))
    local = set->get<Matrix4>();
  const Value* order_value = order < 0 ? nullptr : graph.FindValue({node, order, -1, -1});
  const RotateOrder rotate_order =
      order_value == nullptr ? RotateOrder::kXyz : static_cast<RotateOrder>(order_value->AsInt());
  return local * Translation(SetDouble3(graph, node, "translate", {})) *
         RotationFromEuler(SetDouble3(graph, node, "rotate", {}), rotate_order) *
         Scaling(SetDouble3(graph, node, "scale", {1, 1, 1}));
}

bool RestPlaces::VertexPlaces(const YamlNode& vertices, const YamlNode* mesh_node, Places* places) const {
  std::size_t mesh = 0;
  if (mesh_node != nullptr) {
    std::string name;
    if (!ReadString(*mesh_node, "mesh", &name, in_.errors)) return false;
    const std::optional<std::size_t> found = in_.names.FindMesh(name, mesh_node->where());
    if (!found.has_value()) return false;
    mesh = *found;
  } else if (in_.rig.scene.meshes.size() != 1) {
    return in_.errors->Add(
        vertices, "the character has {} meshes: name the one that the vertices are of, \"mesh: NAME\"",
        in_.rig.scene.meshes.size());
  }
  const CharacterMesh& of = in_.rig.scene.meshes[mesh];
  std::vector<Index> list;
  if (!ReadVertices(vertices, of.vertex_count, of.name, &list, in_.errors)) return false;
  const Places& points = rest_->WorldPoints(mesh);
  places->clear();
  for (Index v : list) places->push_back(points[of.mesh().data().vertex_to_point[v]]);
  return true;
}

bool RestPlaces::Place(MadeNode* made, int depth) {
  if (made->placed) return true;
  const auto it = made->special.find("at");
  if (it == made->special.end()) {
    made->placed = true;
    return true;
  }
  const YamlNode& at = it->second->value;
  if (made->placing || depth > kMaxPlaceDepth) {
    return in_.errors->Add(at, "\"{}\" {}", made->from->name,
                           made->placing ? "is placed at something that is placed at it"
                                         : "is placed at the end of too long a chain");
  }
  GraphEditor edit(graph_);
  const PlugRef offset = edit.Plug(made->id, "offsetParentMatrix");
  made->placed = true;  // reported once, whatever comes
  if (graph_->FindValue(offset) != nullptr)
    return in_.errors->Add(at, "\"{}\": either \"at\" or offsetParentMatrix, not both", made->from->name);
  made->placing = true;
  made->placed = false;
  Double3 place;
  Matrix4 parent, inverse;
  bool good = ReadPlace(at, it->second->source, depth + 1, &place);
  if (good) good = HangUnderReference(*made, at);
  if (const Connection* connection = graph_->FindConnection(edit.Plug(made->id, "parentMatrix"));
      good && connection != nullptr) {
    good = RestWorld(connection->source.node, at, depth + 1, &parent);
  }
  made->placing = false;
  made->placed = true;
  if (!good) return false;
  if (!Invert(parent, &inverse))
    return in_.errors->Add(at, "\"{}\": its parent is scaled to nothing at rest", made->from->name);
  edit.Set(made->id, "offsetParentMatrix", Translation(TransformPoint(inverse, place)));
  return in_.Fail(at.where(), edit.Take());
}

// A handle at a place of a referenced character, of which nothing says what carries it, goes along with that
// character.
bool RestPlaces::HangUnderReference(const MadeNode& made, const YamlNode& at) {
  GraphEditor edit(graph_);
  const PlugRef parent = edit.Plug(made.id, "parentMatrix");
  if (graph_->FindConnection(parent) != nullptr || graph_->FindValue(parent) != nullptr) return true;
  std::optional<NodeId> of;
  if (at.is_scalar()) {
    if (const Result<NodeId> node = graph_->FindNode(at.scalar); node.ok()) of = *node;
  } else if (const YamlNode* mesh = at.is_map() ? at.Find("mesh") : nullptr) {
    if (const auto found = in_.names.FindMesh(mesh->scalar, mesh->where()))
      of = in_.rig.scene.meshes[*found].transform;
  }
  const Reference* reference = of.has_value() ? ReferenceOf(in_.rig, *of) : nullptr;
  if (reference == nullptr) return true;
  edit.Connect(edit.Plug(reference->root, "worldMatrix"), parent);
  return in_.Fail(at.where(), edit.Take());
}

bool RestPlaces::RestWorld(NodeId transform, const YamlNode& asked, int depth, Matrix4* world) {
  *world = Matrix4();
  for (NodeId node = transform;; ++depth) {
    if (depth > kMaxPlaceDepth) return in_.errors->Add(asked, "places depend on each other too deeply");
    if (const Index gltf_node = in_.names.GltfNode(node); gltf_node != kNoIndex) {
      *world = rest_->NodeWorld(gltf_node) * *world;
      return true;
    }
    MadeNode* made = nodes_->Find(node);
    if (made != nullptr && !Place(made, depth + 1)) return false;
    *world = LocalAtRest(in_.rig, node) * *world;
    const int parent = graph_->def(node).FindAttribute("parentMatrix");
    const Connection* connection = parent < 0 ? nullptr : graph_->FindConnection({node, parent, -1, -1});
    if (connection == nullptr) return true;
    node = connection->source.node;
  }
}

const Places* RestPlaces::CurveOf(const std::string& name) const {
  const MadeNode* made = nodes_->Find(name);
  const auto it = made == nullptr ? curves_.end() : curves_.find(made->id.index);
  return it == curves_.end() ? nullptr : &it->second;
}

bool RestPlaces::ReadPlace(const YamlNode& node, int source, int depth, Double3* place) {
  if (node.is_sequence()) {
    std::vector<double> p;
    if (!ReadNumbers(node, "place", Unit::kLength, in_.units(source), 3, &p, in_.errors)) return false;
    *place = {p[0], p[1], p[2]};
    return true;
  }
  if (node.is_map()) {
    YamlMap map(node, "place", in_.errors);
    const YamlNode* vertex = map.Required("vertex");
    const YamlNode* mesh = map.Find("mesh");
    map.RejectUnread();
    Places places;
    if (vertex == nullptr || !VertexPlaces(*vertex, mesh, &places)) return false;
    if (places.size() != 1)
      return in_.errors->Add(*vertex, "place: expected one vertex, found {}", places.size());
    *place = places[0];
    return true;
  }
  std::string name;
  if (!ReadString(node, "place", &name, in_.errors)) return false;
  if (const Places* cvs = CurveOf(name)) {
    *place = (*cvs)[cvs->size() / 2];
    return true;
  }
  if (const std::size_t open = name.rfind('['); open != std::string::npos && name.back() == ']') {
    std::string curve = name.substr(0, open);
    if (curve.size() > 3 && curve.compare(curve.size() - 3, 3, ".cv") == 0) curve.resize(curve.size() - 3);
    if (const Places* cvs = CurveOf(curve)) {
      const Result<double> index =
          ParseQuantity(name.substr(open + 1, name.size() - open - 2), Unit::kNone, FileUnits());
      if (!index.ok() || *index < 0 || *index != std::floor(*index) ||
          *index >= static_cast<double>(cvs->size())) {
        return in_.errors->Add(node, "\"{}\": curve \"{}\" has cvs 0 to {}", name, curve, cvs->size() - 1);
      }
      *place = (*cvs)[static_cast<std::size_t>(*index)];
      return true;
    }
  }
  const std::optional<NodeId> transform = in_.names.FindTransform(name, node.where());
  Matrix4 world;
  if (!transform.has_value() || !RestWorld(*transform, node, depth, &world)) return false;
  *place = {world(0, 3), world(1, 3), world(2, 3)};
  return true;
}

}  // namespace kpsa::engine
