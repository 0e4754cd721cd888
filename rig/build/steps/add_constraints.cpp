#include "rig/build/steps/add_constraints.h"

#include <algorithm>
#include <optional>

#include "rig/graph_editor.h"

namespace kpsa::engine {
namespace {

struct NamedTransform {
  NodeId id;
  std::string name;
  SourceLocation where;  // of the key's value
};
// A joint whose local matrix below all constraints a chain (IK) reads: so the end may have one, too.
struct ChainJoint {
  NodeId joint;
  PlugRef to;
  SourceLocation where;
};

class Constraints {
 public:
  Constraints(const BuildInput& in, ConstrainedPlugs* plugs, Graph* graph)
      : in_(in), plugs_(plugs), graph_(graph) {}

  void ConnectAll(const MadeNodes& nodes) {
    for (const MadeNode& made : nodes) {
      if (in_.errors->full()) return;
      const std::string& type = graph_->def(made.id).name;
      if (made.Find("targets") != nullptr && type != "blendShape") ConnectTargets(made);
      if (type == "ikHandle") {
        ConnectIk(made);
      } else if (type == "splineIk") {
        ConnectSplineIk(made);
      } else if (type == "twistDistribution") {
        ConnectTwist(made);
      } else if (const RigAttribute* key = made.Find("constrained")) {
        const SourceLocation where = key->value.where();
        std::string name;
        if (!ReadString(key->value, "constrained", &name, in_.errors)) continue;
        if (type == "poleVectorConstraint") {
          ConstrainPole(made, name, where);
          continue;
        }
        const std::optional<NodeId> transform = in_.names.FindTransform(name, where);
        if (transform.has_value() && plugs_->ConnectParentOf(*transform, made, where))
          plugs_->Constrain(*transform, made, "inMatrix", "outMatrix", -1, where);
      }
    }
  }
  void ConnectChainJoints() {
    // Chains read their joints last, when it is known which of them have a constraint of their own
    for (const ChainJoint& joint : chain_joints_) {
      if (in_.errors->full()) return;
      GraphEditor edit(graph_);
      const auto below = in_.rig.scene.clip_inputs.find(joint.joint.index);
      edit.Connect(
          below == in_.rig.scene.clip_inputs.end() ? edit.Plug(joint.joint, "matrix") : below->second,
          joint.to);
      in_.Fail(joint.where, edit.Take());
    }
  }

 private:
  // The transform that a key names; none, with its error, where there is no such one.
  std::optional<NamedTransform> ReadTransform(const MadeNode& made, const char* key) {
    const YamlNode& value = made.Find(key)->value;
    NamedTransform named{NodeId(), "", value.where()};
    if (!ReadString(value, key, &named.name, in_.errors)) return std::nullopt;
    const std::optional<NodeId> found = in_.names.FindTransform(named.name, named.where);
    if (!found.has_value()) return std::nullopt;
    named.id = *found;
    return named;
  }

  // All of the keys, or none of them: then the node's plugs are connected one by one, and it is left alone.
  std::optional<std::vector<NamedTransform>> ReadTransforms(const MadeNode& made,
                                                            const std::vector<const char*>& keys) {
    std::vector<NamedTransform> all;
    std::size_t written = 0;
    for (const char* key : keys) {
      if (made.Find(key) == nullptr) continue;
      ++written;
      if (std::optional<NamedTransform> named = ReadTransform(made, key)) all.push_back(std::move(*named));
    }
    if (written != 0 && written != keys.size()) {
      in_.Fail(made.from->where, Status::Invalid("{} \"{}\": expected all of {}", graph_->def(made.id).name,
                                                 made.from->name, fmt::join(keys, ", ")));
    }
    if (all.size() != keys.size()) return std::nullopt;
    return all;
  }

  void ConnectTargets(const MadeNode& made) {
    const YamlNode& value = made.Find("targets")->value;
    const bool one = value.is_scalar();
    if (!one && (!value.is_sequence() || value.items.empty())) {
      in_.errors->Add(value, "targets: expected a list of transforms, found {}",
                      value.is_sequence() ? "none" : value.kind_name());
      return;
    }
    for (std::size_t i = 0; i < (one ? 1 : value.items.size()); ++i) {
      const YamlNode& item = one ? value : value.items[i];
      std::string name;
      if (!ReadString(item, "targets", &name, in_.errors)) continue;
      const std::optional<NodeId> target = in_.names.FindTransform(name, item.where());
      if (!target.has_value()) continue;
      GraphEditor edit(graph_);
      edit.Connect(edit.Plug(*target, "worldMatrix"),
                   edit.Plug(made.id, "targetMatrix", static_cast<int>(i)));
      in_.Fail(item.where(), edit.Take());
    }
  }

  // The transforms below `top` down to `bottom`, which is the last. False where `top` is no ancestor.
  bool ChainBelow(NodeId top, NodeId bottom, std::vector<NodeId>* chain) const {
    chain->clear();
    for (NodeId node = bottom; !(node == top);) {
      chain->push_back(node);
      const int parent = graph_->def(node).FindAttribute("parentMatrix");
      const Connection* above = parent < 0 ? nullptr : graph_->FindConnection({node, parent, -1, -1});
      if (above == nullptr ||
          above->source.attribute != graph_->def(above->source.node).FindAttribute("worldMatrix"))
        return false;
      node = above->source.node;
    }
    std::reverse(chain->begin(), chain->end());
    return !chain->empty();
  }

  bool FailNoAncestor(const NamedTransform& above, const char* above_key, const NamedTransform& below,
                      const char* below_key) const {
    return in_.Fail(above.where, Status::Invalid("{} \"{}\" is no ancestor of {} \"{}\"", above_key,
                                                 above.name, below_key, below.name));
  }

  void ConnectIk(const MadeNode& made) {
    const std::vector<const char*> keys = {"start", "mid", "end"};
    const auto joints = ReadTransforms(made, keys);
    if (!joints.has_value()) return;
    std::vector<NodeId> chain;
    GraphEditor edit(graph_);
    for (std::size_t bone = 0; bone < 2; ++bone) {
      const NamedTransform &above = (*joints)[bone], &below = (*joints)[bone + 1];
      if (!ChainBelow(above.id, below.id, &chain)) {
        FailNoAncestor(above, keys[bone], below, keys[bone + 1]);
        return;
      }
      if (bone == 0) chain.pop_back();  // the middle itself
      for (std::size_t i = 0; i < chain.size(); ++i) {
        const char* to = bone == 0 ? "betweenMatrix" : "belowMatrix";
        chain_joints_.push_back({chain[i], edit.Plug(made.id, to, static_cast<int>(i)), made.from->where});
      }
    }
    const NamedTransform &start = (*joints)[0], &mid = (*joints)[1];
    if (in_.Fail(made.from->where, edit.Take()) && plugs_->ConnectParentOf(start.id, made, start.where) &&
        plugs_->Constrain(start.id, made, "inStartMatrix", "startMatrix", -1, start.where))
      plugs_->Constrain(mid.id, made, "inMidMatrix", "midMatrix", -1, mid.where);
  }

  void ConnectSplineIk(const MadeNode& made) {
    const auto ends = ReadTransforms(made, {"start", "end"});
    if (!ends.has_value()) return;
    const NamedTransform &start = (*ends)[0], &end = (*ends)[1];
    std::vector<NodeId> chain;
    if (!ChainBelow(start.id, end.id, &chain)) {
      FailNoAncestor(start, "start", end, "end");
      return;
    }
    chain.insert(chain.begin(), start.id);
    chain.pop_back();
    GraphEditor edit(graph_);
    chain_joints_.push_back({end.id, edit.Plug(made.id, "tipMatrix"), made.from->where});
    if (!in_.Fail(end.where, edit.Take()) || !plugs_->ConnectParentOf(start.id, made, start.where)) return;
    for (std::size_t i = 0; i < chain.size(); ++i) {
      if (!plugs_->Constrain(chain[i], made, "inMatrix", "outMatrix", static_cast<int>(i), start.where))
        return;
    }
  }

  // Joints hang under `start` or under one another: `parents` says how.
  void ConnectTwist(const MadeNode& made) {
    const RigAttribute* key = made.Find("constrained");
    const bool has_ends = made.Find("start") != nullptr || made.Find("end") != nullptr;
    if ((key != nullptr) != has_ends) {
      in_.Fail(made.from->where,
               Status::Invalid("twistDistribution \"{}\": expected all of start, end, constrained",
                               made.from->name));
      return;
    }
    const auto ends = ReadTransforms(made, {"start", "end"});
    if (!ends.has_value()) return;
    const YamlNode& list = key->value;
    if (!list.is_sequence()) {
      in_.errors->Add(list, "constrained: expected a list of transforms, found {}", list.kind_name());
      return;
    }
    GraphEditor edit(graph_);
    edit.Connect(edit.Plug((*ends)[0].id, "worldMatrix"), edit.Plug(made.id, "startMatrix"));
    edit.Connect(edit.Plug((*ends)[1].id, "worldMatrix"), edit.Plug(made.id, "endMatrix"));
    if (!in_.Fail(made.from->where, edit.Take())) return;
    std::vector<NodeId> joints;
    std::vector<std::int64_t> parents;
    for (const YamlNode& item : list.items) {
      std::string name;
      if (!ReadString(item, "constrained", &name, in_.errors)) return;
      const std::optional<NodeId> joint = in_.names.FindTransform(name, item.where());
      if (!joint.has_value()) return;
      const int above = graph_->def(*joint).FindAttribute("parentMatrix");
      const Connection* parent = graph_->FindConnection({*joint, above, -1, -1});
      const NodeId parent_node = parent == nullptr ? NodeId() : parent->source.node;
      const auto listed = std::find(joints.begin(), joints.end(), parent_node);
      if (listed == joints.end() && !(parent_node == (*ends)[0].id)) {
        in_.errors->Add(item,
                        "\"{}\" hangs neither under start \"{}\" nor under a joint that is named before it",
                        name, (*ends)[0].name);
        return;
      }
      parents.push_back(listed == joints.end() ? -1 : listed - joints.begin());
      const int element = static_cast<int>(joints.size());
      joints.push_back(*joint);
      if (!plugs_->Constrain(*joint, made, "inMatrix", "outMatrix", element, item.where())) return;
    }
    edit.Set(made.id, "parents", Value(std::move(parents)));
    in_.Fail(list.where(), edit.Take());
  }

  void ConstrainPole(const MadeNode& made, const std::string& name, const SourceLocation& where) {
    const Result<NodeId> handle = graph_->FindNode(name);
    if (!in_.Fail(where, handle.status())) return;
    if (graph_->def(*handle).name != "ikHandle") {
      in_.Fail(where,
               Status::Invalid("\"{}\" is a {}; expected an ikHandle", name, graph_->def(*handle).name));
      return;
    }
    GraphEditor edit(graph_);
    const PlugRef pole = edit.Plug(*handle, "poleVector"), in = edit.Plug(made.id, "inMatrix"),
                  out = edit.Plug(made.id, "outMatrix");
    if (in_.Fail(where, edit.Take())) plugs_->TakeOver(pole, made, in, out, where);
  }

  const BuildInput& in_;
  ConstrainedPlugs* plugs_;
  Graph* graph_;
  std::vector<ChainJoint> chain_joints_;
};

}  // namespace

void AddConstraints(const BuildInput& in, const MadeNodes& nodes, ConstrainedPlugs* plugs, Graph* graph) {
  Constraints constraints(in, plugs, graph);
  constraints.ConnectAll(nodes);
  constraints.ConnectChainJoints();
}

}  // namespace kpsa::engine
