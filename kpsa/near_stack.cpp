#include "kpsa/near_stack.h"

#include <algorithm>

#include "base/matrix.h"
#include "kpsa/signals.h"

namespace kpsa::engine {
namespace {

Double3 Origin(const Matrix4& m) { return {m(0, 3), m(1, 3), m(2, 3)}; }

void ComputeSpaceOffset(NodeContext<In<"matrix", Matrix4>, Out<"offset", Double3>> c) {
  c.out<"offset">() = c.kernel_as<Double3>() - Origin(c.get<"matrix">());
}
void ComputeMoved(NodeContext<In<"matrix", Matrix4>, In<"offset", Double3>, Out<"outMatrix", Matrix4>> c) {
  Matrix4 m = c.get<"matrix">();
  const Double3& by = c.get<"offset">();
  m(0, 3) += by.x, m(1, 3) += by.y, m(2, 3) += by.z;
  c.out<"outMatrix">() = m;
}
void ComputeMovedInverse(
    NodeContext<In<"matrix", Matrix4>, In<"offset", Double3>, Out<"outInverseMatrix", Matrix4>> c) {
  const Double3& by = c.get<"offset">();
  c.out<"outInverseMatrix">() = c.get<"matrix">() * Translation({-by.x, -by.y, -by.z});
}

bool HasPointInputs(const NodeDef& def) {
  for (const AttributeDef& a : def.attributes) {
    if (!a.output && IsPointType(a.type)) return true;
  }
  return false;
}

}  // namespace

NearStacks::NearStacks(Graph* graph, const AccelerationTarget& target, const PlugRef& space_world,
                       Double3 rest_origin)
    : graph_(graph), varying_(target.varying) {
  for (const AccelerationTarget::Stage& stage : target.all_stages)
    world_[{stage.points.node.index, stage.points.element}] = stage.world;
  const Result<NodeId> node = graph_->AddNode("spaceOffset", graph_->FreeNodeName("kpsa_offset"));
  if (!node.ok()) return;
  const NodeDef& def = graph_->def(*node);
  const bool good = graph_->Set({*node, def.FindAttribute("restOrigin"), -1, -1}, rest_origin).ok() &&
                    graph_->Connect(space_world, {*node, def.FindAttribute("matrix"), -1, -1}).ok();
  if (good) offset_ = {*node, def.FindAttribute("offset"), -1, -1};
}

std::optional<PlugRef> NearStacks::Near(const PlugRef& points) {
  if (offset_.attribute < 0) return std::nullopt;
  return Copy(points);
}

// The matrix of a transform, moved; no others are known to be of the world.
std::optional<PlugRef> NearStacks::NearMatrix(const PlugRef& source) {
  bool inverse = false;
  if (source.attribute >= 0) {  // else the world itself
    const NodeDef& def = graph_->def(source.node);
    if (def.FindAttribute("worldMatrix") == source.attribute) {
    } else if (def.FindAttribute("worldInverseMatrix") == source.attribute) {
      inverse = true;
    } else {
      return std::nullopt;
    }
  }
  const auto key = std::tuple(source.node.index, source.attribute, source.element);
  if (const auto known = matrices_.find(key); known != matrices_.end()) return known->second;
  const Result<NodeId> node = graph_->AddNode("offsetMatrix", graph_->FreeNodeName("kpsa_near"));
  if (!node.ok()) return std::nullopt;
  const NodeDef& def = graph_->def(*node);
  if (!graph_->Connect(offset_, {*node, def.FindAttribute("offset"), -1, -1}).ok()) return std::nullopt;
  if (source.attribute >= 0 && !graph_->Connect(source, {*node, def.FindAttribute("matrix"), -1, -1}).ok())
    return std::nullopt;
  const PlugRef moved{*node, def.FindAttribute(inverse ? "outInverseMatrix" : "outMatrix"), -1, -1};
  matrices_.emplace(key, moved);
  return moved;
}

// Its offset moves joints, and so only what it takes to them.
bool NearStacks::SkinsInPart(NodeId skin) const {
  for (const char* name : {"envelope", "weights"}) {
    const int attribute = graph_->def(skin).FindAttribute(name);
    if (!graph_->Values(skin, attribute).empty() || !graph_->Inputs(skin, attribute).empty()) return true;
    for (const PlugRef& plug : varying_) {
      if (plug.node == skin && plug.attribute == attribute) return true;
    }
  }
  return false;
}

bool NearStacks::CopyInput(const PlugRef& from, const Connection& connection, const PlugRef& to) {
  const NodeDef& def = graph_->def(from.node);
  const AttributeDef& a = def.attributes[static_cast<std::size_t>(from.attribute)];
  PlugRef source = connection.source;
  if (a.name == "inPoints" || a.name == "driverPoints") {
    const auto stage = world_.find({source.node.index, source.element});
    if (stage == world_.end()) {
      if (HasPointInputs(graph_->def(source.node)) || a.name == "driverPoints") return false;
    } else if (stage->second) {
      const std::optional<PlugRef> near = Copy(source);
      if (!near.has_value()) return false;
      source = *near;
    }
  } else if (a.type == Type::kMatrix && def.FindAttribute("offset") < 0) {
    const std::optional<PlugRef> near = NearMatrix(source);
    if (!near.has_value()) return false;
    source = *near;
  }
  return graph_->Connect(source, to).ok();
}

// A copy of the node that gives the points. What may vary is read off the original's inputs.
std::optional<PlugRef> NearStacks::Copy(const PlugRef& points) {
  const auto stage = world_.find({points.node.index, points.element});
  if (stage == world_.end() || !stage->second) return std::nullopt;
  const auto made = [&](NodeId node) { return PlugRef{node, points.attribute, points.element, -1}; };
  if (const auto known = copies_.find(points.node.index); known != copies_.end()) return made(known->second);
  const NodeId from = points.node;
  const NodeDef& def = graph_->def(from);
  if (def.FindAttribute("offset") >= 0 && SkinsInPart(from)) return std::nullopt;
  const Result<NodeId> copy = graph_->AddNode(def.name, graph_->FreeNodeName(graph_->name(from) + "_near"));
  if (!copy.ok()) return std::nullopt;
  for (std::size_t i = 0; i < def.attributes.size(); ++i) {
    const AttributeDef& a = def.attributes[i];
    const auto attribute = static_cast<int>(i);
    if (a.output) continue;
    if (const auto* names = graph_->ElementNames(from, attribute))
      graph_->SetElementNames(*copy, attribute, *names);
    const PlugRef whole{*copy, attribute, -1, -1};
    if (a.name == "offset") {
      if (!graph_->Connect(offset_, whole).ok()) return std::nullopt;
      continue;
    }
    std::vector<Connection> connections;
    for (const Connection& c : graph_->Inputs(from, attribute)) connections.push_back(c);
    const bool followed = a.structural || IsPointType(a.type) || a.type == Type::kMatrix;
    const bool varies = std::any_of(varying_.begin(), varying_.end(), [&](const PlugRef& plug) {
      return plug.node == from && plug.attribute == attribute;
    });
    if (!followed && varies) {  // read off the original, whose plug is the one that is set
      const int size = a.array ? graph_->ArraySize(from, attribute) : 1;
      for (int e = 0; e < size; ++e) {
        const int element = a.array ? e : -1;
        if (!graph_->Connect({from, attribute, element, -1}, {*copy, attribute, element, -1}).ok())
          return std::nullopt;
      }
      continue;
    }
    if (!followed) {  // as it is: what rests where it does nothing is left out of plans here, too
      for (const SetValue& set : graph_->RestValues(from, attribute)) {
        PlugRef to = set.plug;
        to.node = *copy;
        if (!graph_->Set(to, set.value).ok()) return std::nullopt;
      }
      for (const SetValue& set : graph_->Values(from, attribute)) {
        PlugRef to = set.plug;
        to.node = *copy;
        if (graph_->IsPosed(from, attribute) && !graph_->Pose(to, set.value).ok()) return std::nullopt;
      }
      for (const Connection& c : connections) {
        PlugRef to = c.destination;
        to.node = *copy;
        if (!graph_->Connect(c.source, to).ok()) return std::nullopt;
      }
      continue;
    }
    for (const SetValue& set : graph_->Values(from, attribute)) {
      PlugRef to = set.plug;
      to.node = *copy;
      if (!graph_->Set(to, set.value).ok()) return std::nullopt;
    }
    for (const Connection& c : connections) {
      PlugRef to = c.destination;
      to.node = *copy;
      if (!CopyInput(c.destination, c, to)) return std::nullopt;
    }
    // What stands in the world moves, too
    if (a.world_place && connections.empty() && graph_->Values(from, attribute).empty()) {
      const std::optional<PlugRef> near = NearMatrix(PlugRef());
      if (!near.has_value() || !graph_->Connect(*near, whole).ok()) return std::nullopt;
    }
  }
  copies_.emplace(from.index, *copy);
  return made(*copy);
}

void AddNearNodes(NodeRegistry& registry) {
  registry.add("spaceOffset", "How far a space has moved since rest, to be taken back.")
      .category("acceleration")
      .in("matrix", Matrix4(), {.doc = "the space's worldMatrix"})
      .structural("restOrigin", Double3(), {.unit = Unit::kLength, .doc = "where it is at rest"})
      .out("offset", Type::kDouble3, "restOrigin less the place of the matrix")
      .unit(Unit::kLength)
      .compute<ComputeSpaceOffset>()
      .bind([](const Binding& binding) -> Result<BoundKernel> {
        return BoundKernel{
            std::make_shared<const Double3>(binding.structural().value("restOrigin").get<Double3>()), 0, 0};
      });
  registry.add("offsetMatrix", "A world matrix that is moved, and the inverse of one.")
      .category("acceleration")
      .in("matrix", Matrix4())
      .in("offset", Double3(), {.unit = Unit::kLength})
      .out("outMatrix", Type::kMatrix, "matrix, then moved by offset")
      .out("outInverseMatrix", Type::kMatrix, "moved back by offset, then matrix")
      .compute<ComputeMoved>()
      .compute<ComputeMovedInverse>();
}

}  // namespace kpsa::engine
