#include "kpsa/signature.h"

#include <algorithm>
#include <set>

#include "base/digest.h"

namespace kpsa {
namespace {

std::string Short(const Digest& digest) { return digest.ToHex().substr(0, 12); }

}  // namespace

Signature RigSignature(const Graph& graph, const std::vector<PlugRef>& outputs, const std::vector<PlugRef>& controls) {
  // All nodes upstream of the outputs, clips left out
  std::vector<NodeId> stack;
  std::set<Index> seen;
  for (const PlugRef& output : outputs) {
    if (seen.insert(output.node.index).second) stack.push_back(output.node);
  }
  Signature signature;
  std::set<std::tuple<Index, int, int>> moving;  // plugs whose held value says nothing
  for (const PlugRef& control : controls) moving.emplace(control.node.index, control.attribute, control.element);
  while (!stack.empty()) {
    const NodeId node = stack.back();
    stack.pop_back();
    const NodeDef& def = graph.def(node);
    const std::string& name = graph.name(node);
    std::vector<std::string> connections;
    for (const Connection& c : graph.Inputs(node)) {
      if (graph.def(c.source.node).animation) continue;
      connections.push_back(graph.PlugName(c.source) + ">" + graph.PlugName(c.destination));
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
      const int elements = a.array || IsPointType(a.type) ? std::max(graph.ArraySize(node, attribute), 1) : 1;
      for (int e = -1; e < elements; ++e) {
        if (moving.count({node.index, attribute, e}) != 0) continue;
        for (int component = -1; component < 4; ++component) {
          const Value* value = graph.FindValue({node, attribute, e, component});
          if (value == nullptr) continue;
          if (plain && component == -1 && value->digest() == a.default_value.digest()) continue;
          values.Add(e);
          values.Add(component);
          values.Add(value->digest());
          any = true;
        }
      }
      if (any) signature[name + "." + a.name] = Short(values.Finish());
    }
  }
  return signature;
}

std::string SignatureDifference(const Signature& trained, const Signature& now) {
  std::vector<std::string> nodes, attributes, rewired;  // by what they say: an attribute says more than its node
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
  return fmt::format("{}{}", fmt::join(changed, ", "), count > 3 ? fmt::format(" and {} more", count - 3) : "");
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
