#include "kpsa/signature.h"

#include <algorithm>
#include <array>
#include <numbers>
#include <optional>
#include <set>
#include <tuple>

#include "base/digest.h"
#include "kpsa/signals.h"

namespace kpsa::engine {
namespace {

using Plugs = std::vector<PlugRef>;
using Values = std::span<const SetValue>;

std::string Short(const Digest& digest) { return digest.ToHex().substr(0, 12); }

// What the points depend on, and whose poses say nothing because guards see them.
class Upstream {
 public:
  Upstream(const Graph& graph, const Plugs& outputs, const Plugs& space, const Plugs& controls,
           const RigWithin& within)
      : graph_(graph), within_(within) {
    std::set<Index> seen;
    const auto add = [&](NodeId node) {
      if (node != within.root && seen.insert(node.index).second) nodes_.push_back(node);
    };
    for (const PlugRef& output : outputs) add(output.node);
    for (const PlugRef& frame : space) {
      if (frame.node == within.root) continue;
      add(frame.node);
      for (const NodeId node : ParentsFrom(graph, frame.node)) carriers_.insert(node.index);
    }
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      for (const Connection& c : graph.Inputs(nodes_[i])) {
        if (!graph.def(c.source.node).animation) add(c.source.node);
      }
    }
    for (const PlugRef& control : controls)
      controls_.emplace(control.node.index, control.attribute, control.element, control.component);
  }

  const std::vector<NodeId>& nodes() const { return nodes_; }
  bool IsCarrier(NodeId node) const { return carriers_.count(node.index) != 0; }
  bool IsControl(const PlugRef& plug) const {
    return controls_.count({plug.node.index, plug.attribute, plug.element, plug.component}) != 0;
  }
  std::string Name(NodeId node) const { return within_.Inner(graph_.name(node)); }

  std::string NodeDigest(NodeId node) const {
    std::vector<std::pair<std::string, std::string>> connections;
    for (const Connection& c : graph_.Inputs(node)) {
      if (graph_.def(c.source.node).animation || c.source.node == within_.root) continue;
      connections.emplace_back(within_.Inner(graph_.PlugName(c.source)),
                               within_.Inner(graph_.PlugName(c.destination)));
    }
    std::sort(connections.begin(), connections.end());
    const NodeDef& def = graph_.def(node);
    Hasher hasher;
    hasher.Add(std::string_view(def.name));
    hasher.Add(def.version);
    for (const auto& [source, destination] : connections) {
      hasher.Add(std::string_view(source));
      hasher.Add(std::string_view(destination));
    }
    return Short(hasher.Finish());
  }

  bool Counts(const AttributeDef& a) const { return !a.output && !a.diagnostic && a.name != "time"; }

  // Of an attribute with all that is set, or `written`: with what the rig says. "" where that is nothing.
  std::string AttributeDigest(NodeId node, int attribute, bool written) const {
    const AttributeDef& a = graph_.def(node).attributes[static_cast<std::size_t>(attribute)];
    const Values values = written ? graph_.WrittenValues(node, attribute) : graph_.Values(node, attribute);
    const bool posed = graph_.IsPosed(node, attribute);
    const Values rest = posed ? graph_.RestValues(node, attribute) : values;
    // What is written as it is anyway changes nothing (nodes may ask whether a structural one is set)
    const bool plain = !a.structural && !a.default_from && !a.array && !IsPointType(a.type);
    Hasher hasher;
    bool any = false;
    const auto add = [&](const SetValue& set) {
      if (plain && set.plug.component == -1 && set.value.digest() == a.default_value.digest()) return;
      hasher.Add(set.plug.element);
      hasher.Add(set.plug.component);
      hasher.Add(set.value.digest());
      any = true;
    };
    for (const SetValue& set : rest) add(set);
    for (const SetValue& set : values) {
      if (!posed || IsCarrier(node) || IsControl(set.plug)) continue;
      const bool held = std::any_of(rest.begin(), rest.end(), [&](const SetValue& r) {
        return r.plug == set.plug && r.value.digest() == set.value.digest();
      });
      if (!held) add(set);
    }
    return any ? Short(hasher.Finish()) : "";
  }

 private:
  const Graph& graph_;
  const RigWithin& within_;
  std::vector<NodeId> nodes_;
  std::set<Index> carriers_;
  std::set<std::tuple<Index, int, int, int>> controls_;
};

// The value that a plug has by what is set on its attribute; nothing where its default depends on others.
std::optional<Value> HeldBy(Values values, const AttributeDef& a, const PlugRef& plug) {
  PlugRef whole = plug;
  whole.component = -1;
  const auto find = [&](const PlugRef& p) -> const Value* {
    const auto it =
        std::find_if(values.begin(), values.end(), [&](const SetValue& set) { return set.plug == p; });
    return it == values.end() ? nullptr : &it->value;
  };
  if (const Value* value = find(plug)) return *value;
  const Value* value = find(whole);
  if (value == nullptr) value = a.default_from || IsPointType(a.type) ? nullptr : &a.default_value;
  if (value == nullptr) return std::nullopt;
  if (plug.component < 0) return *value;
  if (const auto* v = value->get_if<Double3>()) return Value((*v)[plug.component]);
  if (const auto* q = value->get_if<Quaternion>())
    return Value(std::array<double, 4>{q->x, q->y, q->z, q->w}[static_cast<std::size_t>(plug.component)]);
  return std::nullopt;
}

bool SameValue(const Value& a, const Value& b) {
  if (const auto* x = a.get_if<double>()) return b.get_if<double>() != nullptr && *x == b.get<double>();
  return a.digest() == b.digest();
}

std::string ValueText(const AttributeDef& a, const Value& value) {
  if (a.type == Type::kEnum) {
    const auto choice = static_cast<std::size_t>(value.AsInt());
    return value.get_if<std::int64_t>() != nullptr && choice < a.enum_names.size() ? a.enum_names[choice]
                                                                                   : value.ToString();
  }
  if (value.get_if<double>() == nullptr) return value.ToString();
  if (a.unit == Unit::kAngle) return fmt::format("{:.6g} deg", value.AsDouble() * 180 / std::numbers::pi);
  const char* const unit = a.unit == Unit::kLength ? " m" : a.unit == Unit::kTime ? " s" : "";
  return fmt::format("{:.6g}{}", value.AsDouble(), unit);
}

// The plugs of an attribute, component by component, whose value is not what the rig says.
std::vector<SetHere> Different(const Graph& graph, NodeId node, int attribute) {
  const AttributeDef& a = graph.def(node).attributes[static_cast<std::size_t>(attribute)];
  const Values written = graph.WrittenValues(node, attribute), values = graph.Values(node, attribute);
  std::vector<SetHere> different;
  // Nodes may ask whether a structural one is set
  const bool as_often = !a.structural || values.size() == written.size();
  const auto compare = [&](const PlugRef& plug) {
    const std::optional<Value> now = HeldBy(values, a, plug), before = HeldBy(written, a, plug);
    if (!now.has_value() || (before.has_value() && SameValue(*now, *before) && as_often)) return;
    if (std::any_of(different.begin(), different.end(), [&](const SetHere& d) { return d.plug == plug; }))
      return;
    different.push_back({plug, graph.AuthoredName(plug), ValueText(a, *now), a.structural, false});
  };
  for (const SetValue& set : values) {
    const Type type = graph.PlugType(set.plug);
    const bool point = IsPointType(a.type);  // told as a whole: what it is without being set is not known
    const int components = point ? 0 : type == Type::kDouble3 ? 3 : type == Type::kQuaternion ? 4 : 0;
    if (components == 0) compare(set.plug);
    for (int c = 0; c < components; ++c) {
      PlugRef part = set.plug;
      part.component = c;
      compare(part);
    }
  }
  return different;
}

}  // namespace

Signature RigSignature(const Graph& graph, const std::vector<PlugRef>& outputs,
                       const std::vector<PlugRef>& space, const std::vector<PlugRef>& controls,
                       const RigWithin& within) {
  const Upstream upstream(graph, outputs, space, controls, within);
  Signature signature;
  for (const NodeId node : upstream.nodes()) {
    NodeSignature& of_node = signature[upstream.Name(node)];
    of_node.node = upstream.NodeDigest(node);
    const auto& attributes = graph.def(node).attributes;
    for (std::size_t i = 0; i < attributes.size(); ++i) {
      if (!upstream.Counts(attributes[i])) continue;
      std::string digest = upstream.AttributeDigest(node, static_cast<int>(i), false);
      if (!digest.empty()) of_node.attributes[attributes[i].name] = std::move(digest);
    }
  }
  return signature;
}

std::vector<SetHere> TakeSetHere(const Graph& graph, const std::vector<PlugRef>& outputs,
                                 const std::vector<PlugRef>& space, const std::vector<PlugRef>& controls,
                                 const RigWithin& within, const Signature& trained, Signature* now) {
  const Upstream upstream(graph, outputs, space, controls, within);
  const auto digest_in = [](const Signature& signature, const std::string& node, const std::string& name) {
    const auto of_node = signature.find(node);
    if (of_node == signature.end()) return std::string();
    const auto it = of_node->second.attributes.find(name);
    return it == of_node->second.attributes.end() ? std::string() : it->second;
  };
  std::vector<SetHere> all;
  for (const NodeId node : upstream.nodes()) {
    const std::string name = upstream.Name(node);
    const auto& attributes = graph.def(node).attributes;
    for (std::size_t i = 0; i < attributes.size(); ++i) {
      const AttributeDef& a = attributes[i];
      const auto attribute = static_cast<int>(i);
      if (!upstream.Counts(a)) continue;
      if (graph.Values(node, attribute).data() == graph.WrittenValues(node, attribute).data()) continue;
      std::vector<SetHere> different = Different(graph, node, attribute);
      const bool as_trained = digest_in(trained, name, a.name) == digest_in(*now, name, a.name);
      if (!as_trained) {
        std::string digest = upstream.AttributeDigest(node, attribute, true);
        auto& of_node = (*now)[name].attributes;
        of_node.erase(a.name);
        if (!digest.empty()) of_node[a.name] = std::move(digest);
      }
      for (SetHere& set : different) {
        set.carries = upstream.IsCarrier(node);
        // Poses of controls and carriers are in no signature, so training says nothing of them
        if (!as_trained || set.carries || upstream.IsControl(set.plug)) all.push_back(std::move(set));
      }
    }
  }
  return all;
}

std::string SignatureDifference(const Signature& trained, const Signature& now) {
  std::vector<std::string> nodes, attributes,
      rewired;  // by what they say: an attribute says more than its node
  const auto compare = [&](const Signature& here, const Signature& there, const char* how, bool both) {
    for (const auto& [name, node] : here) {
      const auto other = there.find(name);
      if (other == there.end()) {
        nodes.push_back(name + how);  // its attributes went or came with it
        continue;
      }
      if (both && node.node != other->second.node) rewired.push_back(name);
      for (const auto& [attribute, digest] : node.attributes) {
        const auto it = other->second.attributes.find(attribute);
        if (it == other->second.attributes.end()) {
          attributes.push_back(name + "." + attribute + how);
        } else if (both && it->second != digest) {
          attributes.push_back(name + "." + attribute);
        }
      }
    }
  };
  compare(trained, now, " (gone)", true);
  compare(now, trained, " (new)", false);
  std::vector<std::string> changed = std::move(nodes);
  changed.insert(changed.end(), attributes.begin(), attributes.end());
  changed.insert(changed.end(), rewired.begin(), rewired.end());
  if (changed.empty()) return "";
  const std::size_t count = changed.size();
  if (count > 3) changed.resize(3);
  return fmt::format("{}{}", fmt::join(changed, ", "),
                     count > 3 ? fmt::format(" and {} more", count - 3) : "");
}

std::string SignatureDigest(const Signature& signature) {
  Hasher hasher;
  for (const auto& [name, node] : signature) {
    hasher.Add(std::string_view(name));
    hasher.Add(std::string_view(node.node));
    hasher.Add(static_cast<std::uint64_t>(node.attributes.size()));
    for (const auto& [attribute, digest] : node.attributes) {
      hasher.Add(std::string_view(attribute));
      hasher.Add(std::string_view(digest));
    }
  }
  return hasher.Finish().ToHex();
}

}  // namespace kpsa::engine
