#include "rig/character/character_vrm.h"

#include <map>

#include "rig/character/character_graph.h"
#include "rig/graph_editor.h"

namespace kpsa::engine {

VrmGraph::VrmGraph(const gltf::Character& character, CharacterGraph* scene, Graph* graph)
    : character_(character), scene_(*scene), graph_(graph) {}

Status VrmGraph::AddExpressions() {
  const std::vector<gltf::Expression>& all = character_.expressions;
  if (all.empty()) return {};
  if (all.size() > kMaxExpressions) {
    return Status::Invalid("{}: has {} expressions; at most {} are supported", character_.path, all.size(),
                           kMaxExpressions);
  }
  GraphEditor edit(graph_);
  const NodeId node = edit.AddFresh("vrmExpressions", "expressions");
  if (!edit.ok()) return edit.Take();
  scene_.expressions = node;
  std::vector<std::string> names;
  std::vector<std::int64_t> binary, kind, blink, look_at, mouth;
  for (Index e = 0; e < all.size(); ++e) {
    names.push_back(all[e].name);
    binary.push_back(all[e].is_binary ? 1 : 0);
    kind.push_back(static_cast<std::int64_t>(all[e].kind));
    blink.push_back(static_cast<std::int64_t>(all[e].blink));
    look_at.push_back(static_cast<std::int64_t>(all[e].look_at));
    mouth.push_back(static_cast<std::int64_t>(all[e].mouth));
    edit.Set(node, "weight", static_cast<int>(e), 0.0);
    for (const gltf::ExpressionBind& bind : all[e].binds) binds_[bind.mesh].emplace_back(e, &bind);
  }
  edit.Set(node, "isBinary", Value(std::move(binary)));
  edit.Set(node, "kind", Value(std::move(kind)));
  edit.Set(node, "overrideBlink", Value(std::move(blink)));
  edit.Set(node, "overrideLookAt", Value(std::move(look_at)));
  edit.Set(node, "overrideMouth", Value(std::move(mouth)));
  for (const char* attribute : {"weight", "output"})
    graph_->SetElementNames(node, graph_->def(node).FindAttribute(attribute), names);
  return edit.Take();
}

Status VrmGraph::AddMorphWeights(const std::vector<std::string>& names, CharacterMesh* mesh) {
  const auto found = binds_.find(character_.nodes[mesh->gltf_node].mesh);
  if (found == binds_.end()) return {};
  looked_at_ += found->second.size();
  if (looked_at_ > kMaxBinds)
    return Status::Invalid("{}: expressions bind more than {} morph targets", character_.path, kMaxBinds);
  std::map<Index, int> elements;  // of `expression`, by expression
  std::vector<std::int64_t> targets, expressions;
  std::vector<double> shares;
  for (const auto& [expression, bind] : found->second) {
    if (bind->node != kNoIndex && bind->node != mesh->gltf_node) continue;
    const auto element = elements.emplace(expression, static_cast<int>(elements.size())).first;
    targets.push_back(bind->target);
    expressions.push_back(element->second);
    shares.push_back(bind->weight);
  }
  if (targets.empty()) return {};
  GraphEditor edit(graph_);
  const NodeId node =
      edit.AddFresh("vrmMorphWeights", mesh->name + "_morphWeights", fmt::format("#{}", mesh->gltf_node));
  if (!edit.ok()) return edit.Take();
  edit.Set(node, "targets", Value(std::move(targets)));
  edit.Set(node, "expressions", Value(std::move(expressions)));
  edit.Set(node, "shares", Value(std::move(shares)));
  for (const auto& [expression, element] : elements) {
    edit.Connect(edit.Plug(scene_.expressions, "output", static_cast<int>(expression)),
                 edit.Plug(node, "expression", element));
  }
  for (int k = 0; k < static_cast<int>(names.size()); ++k) {
    edit.Set(node, "weight", k, 0.0);
    edit.Connect(edit.Plug(node, "output", k), edit.Plug(mesh->blend_shape, "weight", k));
  }
  graph_->SetElementNames(node, graph_->def(node).FindAttribute("weight"), names);
  mesh->morph_weights = node;
  return edit.Take();
}

Status VrmGraph::AddConstraints() {
  if (character_.constraints.size() > kMaxNodeConstraints) {
    return Status::Invalid("{}: has {} node constraints; at most {} are supported", character_.path,
                           character_.constraints.size(), kMaxNodeConstraints);
  }
  std::vector<std::string> left_out;
  for (const gltf::NodeConstraint& constraint : character_.constraints)
    KPSA_RETURN_IF_ERROR(AddConstraint(constraint, &left_out));
  if (!left_out.empty()) {
    scene_.notes.push_back(
        fmt::format("{} node constraint(s) would follow what follows them and are ignored: of \"{}\"{}",
                    left_out.size(), left_out[0], left_out.size() > 1 ? ", ..." : ""));
  }
  return {};
}

Status VrmGraph::AddConstraint(const gltf::NodeConstraint& constraint, std::vector<std::string>* left_out) {
  using Type = gltf::NodeConstraint::Type;
  const NodeId transform = scene_.transforms[constraint.node], source = scene_.transforms[constraint.source];
  const std::string name = graph_->name(transform);
  const Matrix4 rest = character_.nodes[constraint.node].LocalMatrix();
  const bool aims = constraint.type == Type::kAim;
  GraphEditor edit(graph_);
  const NodeId node = edit.AddFresh(constraint.type == Type::kRoll ? "vrmRollConstraint"
                                    : aims                         ? "vrmAimConstraint"
                                                                   : "vrmRotationConstraint",
                                    name + "_constraint");
  if (!edit.ok()) return edit.Take();
  edit.Set(node, "inMatrix", rest);
  edit.Set(node, "restMatrix", rest);
  edit.Set(node, "weight", constraint.weight);
  if (constraint.type != Type::kRotation)
    edit.Set(node, aims ? "aimAxis" : "rollAxis", Value(std::int64_t{constraint.axis}));
  if (!aims) edit.Set(node, "sourceRestMatrix", character_.nodes[constraint.source].LocalMatrix());
  edit.Connect(edit.Plug(source, aims ? "worldMatrix" : "matrix"), edit.Plug(node, "sourceMatrix"));
  const Index parent = character_.nodes[constraint.node].parent;
  if (aims && parent != kNoIndex)
    edit.Connect(edit.Plug(scene_.transforms[parent], "worldMatrix"), edit.Plug(node, "parentMatrix"));
  const PlugRef in = edit.Plug(node, "inMatrix"), out = edit.Plug(node, "outMatrix"),
                offset = edit.Plug(transform, "offsetParentMatrix");
  if (!edit.ok()) return edit.Take();
  if (!graph_->Connect(out, offset).ok()) {  // a cycle: nothing else can be wrong
    left_out->push_back(name);
    return graph_->RemoveNode(node);
  }
  scene_.clip_inputs[transform.index] = in;
  return {};
}

}  // namespace kpsa::engine
