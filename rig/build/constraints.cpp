// Constraints and IK of a rig file: `constrained`, `targets`, `start`, `mid`, `end`. A constraint owns the
// offsetParentMatrix of what it constrains; what drove that before, clips included, becomes its input.
#include <algorithm>

#include "rig/build/rig_build.h"

namespace kpsa::engine {

void RigBuild::AddConstraints() {
  ConnectConstraints();
  // Chains read their joints last, when it is known which of them have a constraint of their own
  for (const ChainJoint& joint : chain_joints_) {
    if (errors_->full()) return;
    GraphEditor edit(&graph());
    const auto below = rig_->scene.clip_inputs.find(joint.joint.index);
    edit.Connect(below == rig_->scene.clip_inputs.end() ? edit.Plug(joint.joint, "matrix") : below->second,
                 joint.to);
    Fail(joint.where, edit.Take());
  }
}

void RigBuild::ConnectConstraints() {
  for (Made& made : made_) {
    if (errors_->full()) return;
    const std::string& type = graph().def(made.id).name;
    if (made.special.count("targets") != 0 && type != "blendShape") ConnectTargets(made);
    if (type == "ikHandle") {
      ConnectIk(made);
    } else if (type == "splineIk") {
      ConnectSplineIk(made);
    } else if (type == "twistDistribution") {
      ConnectTwist(made);
    } else if (const auto it = made.special.find("constrained"); it != made.special.end()) {
      const SourceLocation where = it->second->value.where();
      std::string name;
      if (!ReadString(it->second->value, "constrained", &name, errors_)) continue;
      if (type == "poleVectorConstraint") {
        ConstrainPole(made, name, where);
        continue;
      }
      const std::optional<NodeId> transform = FindTransform(name, where);
      if (transform.has_value() && ConnectParentOf(*transform, made, where))
        Constrain(*transform, made, "inMatrix", "outMatrix", -1, where);
    }
  }
}

// The transform that a key names; none, with its error, where there is no such one.
std::optional<RigBuild::NamedTransform> RigBuild::ReadTransform(const Made& made, const char* key) {
  const YamlNode& value = made.special.at(key)->value;
  NamedTransform named{NodeId(), "", value.where()};
  if (!ReadString(value, key, &named.name, errors_)) return std::nullopt;
  const std::optional<NodeId> found = FindTransform(named.name, named.where);
  if (!found.has_value()) return std::nullopt;
  named.id = *found;
  return named;
}

// All of the keys, or none of them: then the node's plugs are connected one by one, and it is left alone.
std::optional<std::vector<RigBuild::NamedTransform>> RigBuild::ReadTransforms(
    const Made& made, const std::vector<const char*>& keys) {
  std::vector<NamedTransform> all;
  std::size_t written = 0;
  for (const char* key : keys) {
    if (made.special.count(key) == 0) continue;
    ++written;
    if (std::optional<NamedTransform> named = ReadTransform(made, key)) all.push_back(std::move(*named));
  }
  if (written != 0 && written != keys.size()) {
    Fail(made.from->where, Status::Invalid("{} \"{}\": expected all of {}", graph().def(made.id).name,
                                           made.from->name, fmt::join(keys, ", ")));
  }
  if (all.size() != keys.size()) return std::nullopt;
  return all;
}

void RigBuild::ConnectTargets(const Made& made) {
  const YamlNode& value = made.special.at("targets")->value;
  const bool one = value.is_scalar();
  if (!one && (!value.is_sequence() || value.items.empty())) {
    errors_->Add(value, "targets: expected a list of transforms, found {}",
                 value.is_sequence() ? "none" : value.kind_name());
    return;
  }
  for (std::size_t i = 0; i < (one ? 1 : value.items.size()); ++i) {
    const YamlNode& item = one ? value : value.items[i];
    std::string name;
    if (!ReadString(item, "targets", &name, errors_)) continue;
    const std::optional<NodeId> target = FindTransform(name, item.where());
    if (!target.has_value()) continue;
    GraphEditor edit(&graph());
    edit.Connect(edit.Plug(*target, "worldMatrix"), edit.Plug(made.id, "targetMatrix", static_cast<int>(i)));
    Fail(item.where(), edit.Take());
  }
}

// The transforms below `top` down to `bottom`, which is the last. False where `top` is no ancestor.
bool RigBuild::ChainBelow(NodeId top, NodeId bottom, std::vector<NodeId>* chain) const {
  chain->clear();
  for (NodeId node = bottom; !(node == top);) {
    chain->push_back(node);
    const int parent = graph().def(node).FindAttribute("parentMatrix");
    const Connection* above = parent < 0 ? nullptr : graph().FindConnection({node, parent, -1, -1});
    if (above == nullptr ||
        above->source.attribute != graph().def(above->source.node).FindAttribute("worldMatrix"))
      return false;
    node = above->source.node;
  }
  std::reverse(chain->begin(), chain->end());
  return !chain->empty();
}

bool RigBuild::FailNoAncestor(const NamedTransform& above, const char* above_key, const NamedTransform& below,
                              const char* below_key) {
  return Fail(above.where, Status::Invalid("{} \"{}\" is no ancestor of {} \"{}\"", above_key, above.name,
                                           below_key, below.name));
}

void RigBuild::ConnectIk(const Made& made) {
  const std::vector<const char*> keys = {"start", "mid", "end"};
  const auto joints = ReadTransforms(made, keys);
  if (!joints.has_value()) return;
  std::vector<NodeId> chain;
  GraphEditor edit(&graph());
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
  if (Fail(made.from->where, edit.Take()) && ConnectParentOf(start.id, made, start.where) &&
      Constrain(start.id, made, "inStartMatrix", "startMatrix", -1, start.where))
    Constrain(mid.id, made, "inMidMatrix", "midMatrix", -1, mid.where);
}

void RigBuild::ConnectSplineIk(const Made& made) {
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
  GraphEditor edit(&graph());
  chain_joints_.push_back({end.id, edit.Plug(made.id, "tipMatrix"), made.from->where});
  if (!Fail(end.where, edit.Take()) || !ConnectParentOf(start.id, made, start.where)) return;
  for (std::size_t i = 0; i < chain.size(); ++i) {
    if (!Constrain(chain[i], made, "inMatrix", "outMatrix", static_cast<int>(i), start.where)) return;
  }
}

// Joints hang under `start` or under one another: `parents` says how.
void RigBuild::ConnectTwist(const Made& made) {
  const auto it = made.special.find("constrained");
  const bool has_ends = made.special.count("start") + made.special.count("end") > 0;
  if ((it != made.special.end()) != has_ends) {
    Fail(made.from->where,
         Status::Invalid("twistDistribution \"{}\": expected all of start, end, constrained",
                         made.from->name));
    return;
  }
  const auto ends = ReadTransforms(made, {"start", "end"});
  if (!ends.has_value()) return;
  const YamlNode& list = it->second->value;
  if (!list.is_sequence()) {
    errors_->Add(list, "constrained: expected a list of transforms, found {}", list.kind_name());
    return;
  }
  GraphEditor edit(&graph());
  edit.Connect(edit.Plug((*ends)[0].id, "worldMatrix"), edit.Plug(made.id, "startMatrix"));
  edit.Connect(edit.Plug((*ends)[1].id, "worldMatrix"), edit.Plug(made.id, "endMatrix"));
  if (!Fail(made.from->where, edit.Take())) return;
  std::vector<NodeId> joints;
  std::vector<std::int64_t> parents;
  for (const YamlNode& item : list.items) {
    std::string name;
    if (!ReadString(item, "constrained", &name, errors_)) return;
    const std::optional<NodeId> joint = FindTransform(name, item.where());
    if (!joint.has_value()) return;
    const int above = graph().def(*joint).FindAttribute("parentMatrix");
    const Connection* parent = graph().FindConnection({*joint, above, -1, -1});
    const NodeId parent_node = parent == nullptr ? NodeId() : parent->source.node;
    const auto listed = std::find(joints.begin(), joints.end(), parent_node);
    if (listed == joints.end() && !(parent_node == (*ends)[0].id)) {
      errors_->Add(item, "\"{}\" hangs neither under start \"{}\" nor under a joint that is named before it",
                   name, (*ends)[0].name);
      return;
    }
    parents.push_back(listed == joints.end() ? -1 : listed - joints.begin());
    const int element = static_cast<int>(joints.size());
    joints.push_back(*joint);
    if (!Constrain(*joint, made, "inMatrix", "outMatrix", element, item.where())) return;
  }
  edit.Set(made.id, "parents", Value(std::move(parents)));
  Fail(list.where(), edit.Take());
}

// Whether the plug of a constraint is still free, so that the rig decides about it.
bool RigBuild::IsUnwritten(const PlugRef& plug) const {
  return graph().FindValue(plug) == nullptr && graph().FindConnection(plug) == nullptr;
}

// `by` takes over what drives or holds `plug`.
bool RigBuild::TakeOver(const PlugRef& plug, const Made& by, const PlugRef& in, const PlugRef& out,
                        const SourceLocation& where) {
  const auto [it, added] = constrained_.emplace(KeyOf(plug), std::pair(by.from->name, where));
  if (!added) {
    return Fail(where,
                Status::Invalid("\"{}\" is constrained twice: by \"{}\" at {}, too", graph().name(plug.node),
                                it->second.first, it->second.second.ToString()));
  }
  GraphEditor edit(&graph());
  const bool free = IsUnwritten(in);
  const bool pinned = std::any_of(overridden_.begin(), overridden_.end(),
                                  [&](const auto& o) { return o.second && o.first == plug; });
  if (const Value* value = graph().FindValue(plug); value != nullptr && free)
    edit.Check(graph().Set(in, *value));
  if (const Connection* driver = graph().FindConnection(plug)) {
    const PlugRef source = driver->source;
    edit.Check(graph().Disconnect(plug));
    if (free && !pinned) edit.Connect(source, in);
  }
  edit.Connect(out, plug);
  stacked_.insert(KeyOf(plug));  // an override is what the constraint gets
  if (pinned || (!free && graph().FindConnection(in) == nullptr)) rig_->pinned.push_back(in);
  return Fail(where, edit.Take());
}

// The parent of what is constrained; of chains, of their first joint.
bool RigBuild::ConnectParentOf(NodeId transform, const Made& by, const SourceLocation& where) {
  GraphEditor edit(&graph());
  if (!edit.Has(by.id, "parentMatrix")) return true;  // it acts on local matrices only
  const PlugRef above = edit.Plug(transform, "parentMatrix"), parent = edit.Plug(by.id, "parentMatrix");
  if (!edit.ok() || !IsUnwritten(parent)) return Fail(where, edit.Take());
  if (const Connection* connection = graph().FindConnection(above))
    return Fail(where, graph().Connect(connection->source, parent));
  const Value* value = graph().FindValue(above);
  return value == nullptr || Fail(where, graph().Set(parent, *value));
}

bool RigBuild::Constrain(NodeId transform, const Made& by, const char* in_name, const char* out_name,
                         int element, const SourceLocation& where) {
  GraphEditor edit(&graph());
  const PlugRef offset = edit.Plug(transform, "offsetParentMatrix"), in = edit.Plug(by.id, in_name, element),
                out = edit.Plug(by.id, out_name, element);
  if (!Fail(where, edit.Take()) || !TakeOver(offset, by, in, out, where)) return false;
  rig_->scene.clip_inputs.try_emplace(transform.index,
                                      in);  // below a constraint of the file, if there is one
  return true;
}

void RigBuild::ConstrainPole(const Made& made, const std::string& name, const SourceLocation& where) {
  const Result<NodeId> handle = graph().FindNode(name);
  if (!Fail(where, handle.status())) return;
  if (graph().def(*handle).name != "ikHandle") {
    Fail(where, Status::Invalid("\"{}\" is a {}; expected an ikHandle", name, graph().def(*handle).name));
    return;
  }
  GraphEditor edit(&graph());
  const PlugRef pole = edit.Plug(*handle, "poleVector"), in = edit.Plug(made.id, "inMatrix"),
                out = edit.Plug(made.id, "outMatrix");
  if (Fail(where, edit.Take())) TakeOver(pole, made, in, out, where);
}

}  // namespace kpsa::engine
