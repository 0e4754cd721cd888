#include "kpsa/signature.h"

#include <algorithm>
#include <set>

#include "base/digest.h"
#include "kpsa/signals.h"

namespace kpsa {
namespace {

std::string Short(const Digest& digest) { return digest.ToHex().substr(0, 12); }

}  // namespace

Signature RigSignature(const Graph& graph, const std::vector<PlugRef>& outputs,
                       const std::vector<PlugRef>& space, const std::vector<PlugRef>& controls,
                       const RigWithin& within) {
  // All nodes upstream of the outputs, clips left out
  std::vector<NodeId> stack;
  std::set<Index> seen, carriers;
  for (const PlugRef& output : outputs) {
    if (seen.insert(output.node.index).second) stack.push_back(output.node);
  }
  for (const PlugRef& frame : space) {
    if (frame.node == within.root) continue;
    if (seen.insert(frame.node.index).second) stack.push_back(frame.node);
    for (const NodeId node : ParentsFrom(graph, frame.node)) carriers.insert(node.index);
  }
  Signature signature;
  std::set<std::tuple<Index, int, int>> moving;  // plugs whose pose says nothing: guards see it
  for (const PlugRef& control : controls)
    moving.emplace(control.node.index, control.attribute, control.element);
  const auto is_moving = [&](const PlugRef& plug) {
    return carriers.count(plug.node.index) != 0 ||
           moving.count({plug.node.index, plug.attribute, plug.element}) != 0;
  };
  while (!stack.empty()) {
    const NodeId node = stack.back();
    stack.pop_back();
    const NodeDef& def = graph.def(node);
    const std::string name = within.Inner(graph.name(node));
    std::vector<std::string> connections;
    for (const Connection& c : graph.Inputs(node)) {
      if (graph.def(c.source.node).animation || c.source.node == within.root) continue;
      connections.push_back(within.Inner(graph.PlugName(c.source)) + ">" +
                            within.Inner(graph.PlugName(c.destination)));
      if (seen.insert(c.source.node.index).second) stack.push_back(c.source.node);
    }
    std::sort(connections.begin(), connections.end());
    Hasher hasher;
    hasher.Add(std::string_view(def.name));
    hasher.Add(def.version);
    for (const std::string& connection : connections) hasher.Add(std::string_view(connection));
    signature[name] = Short(hasher.Finish());
    for (std::size_t i = 0; i < def.attributes.size(); ++i) {
      const AttributeDef& a = def.attributes[i];
      if (a.output || a.diagnostic || a.name == "time") continue;
      const auto attribute = static_cast<int>(i);
      // What is written as it is anyway changes nothing (nodes may ask whether a structural one is set)
      const bool plain = !a.structural && !a.default_from && !a.array && !IsPointType(a.type);
      Hasher values;
      bool any = false;
      const auto add = [&](const SetValue& set) {
        if (plain && set.plug.component == -1 && set.value.digest() == a.default_value.digest()) return;
        values.Add(set.plug.element);
        values.Add(set.plug.component);
        values.Add(set.value.digest());
        any = true;
      };
      const std::span<const SetValue> rest = graph.RestValues(node, attribute);
      for (const SetValue& set : rest) add(set);
      for (const SetValue& set : graph.Values(node, attribute)) {
        if (!graph.IsPosed(node, attribute) || is_moving(set.plug)) continue;
        const bool held = std::any_of(rest.begin(), rest.end(), [&](const SetValue& r) {
          return r.plug == set.plug && r.value.digest() == set.value.digest();
        });
        if (!held) add(set);
      }
      if (any) signature[name + "." + a.name] = Short(values.Finish());
    }
  }
  return signature;
}

std::string SignatureDifference(const Signature& trained, const Signature& now) {
  std::vector<std::string> nodes, attributes,
      rewired;  // by what they say: an attribute says more than its node
  const auto compare = [&](const Signature& here, const Signature& there, const char* how, bool both) {
    for (const auto& [name, digest] : here) {
      const auto it = there.find(name);
      const std::string node = name.substr(0, name.find('.'));
      if (there.find(node) == there.end()) {
        if (node == name) nodes.push_back(name + how);  // its attributes went or came with it
      } else if (it == there.end()) {
        attributes.push_back(name + how);
      } else if (both && it->second != digest) {
        (node == name ? rewired : attributes).push_back(name);
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
  for (const auto& [name, digest] : signature) {
    hasher.Add(std::string_view(name));
    hasher.Add(std::string_view(digest));
  }
  return hasher.Finish().ToHex();
}

}  // namespace kpsa
