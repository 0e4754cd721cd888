// The editable graph: nodes, plugs, connections and set values. It holds no computed values; a Compiler turns
// it and a request into a Plan. Every edit is checked. Not thread-safe.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "base/status.h"
#include "graph/node_registry.h"

namespace kpsa::engine {

// An index and a version: the id of a removed node is noticed instead of meaning its successor.
struct NodeId {
  Index index = kNoIndex;
  std::uint32_t version = 0;
  friend bool operator==(const NodeId&, const NodeId&) = default;
};

// node.attribute, node.attribute[element], node.attribute.component (0..3 for .x .y .z .w), or both.
// For points attributes that are no arrays, element is a point.
struct PlugRef {
  NodeId node;
  int attribute = -1;
  int element = -1;
  int component = -1;
  friend bool operator==(const PlugRef&, const PlugRef&) = default;
};

struct Connection {
  PlugRef source, destination;
};

struct SetValue {
  PlugRef plug;
  Value value;
};

class Graph {
 public:
  // Outlived by the registry, which is complete by now.
  explicit Graph(const NodeRegistry& registry);
  const NodeRegistry& registry() const { return *registry_; }

  // Refused, too, while anything is wrong with the registry's declarations (NodeRegistry::status).
  Result<NodeId> AddNode(std::string_view type, std::string_view name);
  Status RemoveNode(NodeId node);  // with its connections and values
  // Takes over all nodes of another graph of the same registry. Names and aliases begin with `prefix` then,
  // and ids have what is returned added to their index. A name that is taken is an error, and nothing is
  // changed.
  Result<Index> Absorb(Graph other, std::string_view prefix);
  // Unit of numbers: the runtime's (metres, radians, seconds). The type and the range are checked, and that
  // numbers are finite. The latest wins: setting a whole plug forgets what was set on its children (or its
  // single points).
  Status Set(const PlugRef& plug, Value value);
  // What Set would say, which names of choices become numbers for.
  Status CheckValue(const PlugRef& plug, Value* value) const;
  Status Unset(const PlugRef& plug);
  // The same for a pose: everything sees the value but rest states (node_def.h, Structural::rest), which keep
  // what was set on the attribute before its first pose. Structural attributes have no pose: they are set.
  Status Pose(const PlugRef& plug, Value value);
  // Poses so far belong to what is written (a rig's own file); later ones, of structural attributes as well,
  // are told from it by WrittenValues.
  void AdoptPoses();
  // Types must agree (numbers convert); cycles are refused with their whole path. A destination takes one
  // connection; `replace` takes over an existing one. A refused edit changes nothing.
  Status Connect(const PlugRef& source, const PlugRef& destination, bool replace = false);
  Status Disconnect(const PlugRef& destination);
  // Names for the elements of an array (morph targets): plugs may then be written attr[name].
  void SetElementNames(NodeId node, int attribute, std::vector<std::string> names);
  // Another name for a node (a path, `Head#49`), found by FindNode. A node's own name goes before the alias
  // of another. An alias that several nodes claim becomes ambiguous: FindNode then names them all.
  void AddAlias(NodeId node, std::string alias);
  // Attributes that `node` lacks are looked for on `delegate` itself (head_mesh.weight is its blendShape's).
  void AddDelegate(NodeId node, NodeId delegate);

  // "node.attr", "node.attr[3].x", "node.attrX" for a child, "node.attr[name]", "node.attr[s,t,u]".
  // Names may hold dots: the longest existing node name followed by '.' wins that has what follows.
  Result<PlugRef> FindPlug(std::string_view text) const;
  Result<NodeId> FindNode(std::string_view name) const;
  std::string PlugName(const PlugRef& plug) const;
  std::string AuthoredName(const PlugRef& plug) const;  // the same as people write it: "jaw.rotateX"
  // `wanted`, with as many '_' after it as it takes that no node is called so.
  std::string FreeNodeName(std::string wanted) const;
  Type PlugType(const PlugRef& plug) const;  // of the element or component
  // Whether the plug names something that exists: its node lives, arrays have an element, others none, ...
  Status CheckPlug(const PlugRef& plug) const;
  static int MaxElements(const AttributeDef& attribute);  // of an array, points of a points attribute

  bool IsAlive(NodeId node) const;
  const NodeDef& def(NodeId node) const;
  const std::string& name(NodeId node) const;
  std::vector<NodeId> Nodes() const;  // in the order of creation
  Index node_capacity() const { return static_cast<Index>(nodes_.size()); }
  NodeId IdAt(Index index) const;  // version 0 and kNoIndex for a removed node

  const Value* FindValue(const PlugRef& plug) const;  // null where unset
  // What is set on an attribute, its elements and their components, in that order.
  std::span<const SetValue> Values(NodeId node, int attribute) const;
  bool IsPosed(NodeId node, int attribute) const;
  std::span<const SetValue> RestValues(NodeId node, int attribute) const;  // the same without poses
  // The same as before the poses that came after AdoptPoses.
  std::span<const SetValue> WrittenValues(NodeId node, int attribute) const;
  const Connection* FindConnection(const PlugRef& destination) const;
  // Connections into the node, by attribute, element and component of the destination.
  const std::vector<Connection>& Inputs(NodeId node) const;
  std::span<const Connection> Inputs(NodeId node, int attribute) const;
  const std::vector<Connection>& Outputs(NodeId node) const;  // connections out of it
  int ArraySize(NodeId node, int attribute) const;  // elements set or connected: the highest plus one
  const std::vector<std::string>* ElementNames(NodeId node, int attribute) const;

 private:
  struct Node {
    const NodeDef* def = nullptr;  // null: removed
    std::string name;
    std::uint32_t version = 0;
    std::vector<SetValue> values;                                // sorted by plug, as are the inputs
    std::vector<std::pair<int, std::vector<SetValue>>> unposed;  // what was set on posed attributes
    std::vector<std::pair<int, std::vector<SetValue>>> written;  // before poses since AdoptPoses
    std::vector<Connection> inputs, outputs;
    std::vector<std::pair<int, std::vector<std::string>>> element_names;
    std::vector<NodeId> delegates;
    std::vector<std::string> aliases;
  };
  const Node& node(NodeId id) const;
  Node& node(NodeId id);
  Status CheckNumbers(const PlugRef& plug, const Value& value) const;
  Status CheckOverlap(const PlugRef& destination, bool replace) const;
  void AddConnection(const Connection& connection);
  Status CheckCycle(const PlugRef& source, const PlugRef& destination) const;
  Result<int> ParseElement(NodeId id, int attribute, std::string_view text) const;
  Result<PlugRef> FindAttribute(NodeId id, std::string_view text, bool delegates) const;
  std::vector<std::string> Names() const;

  const NodeRegistry* registry_;
  Status registry_status_;
  std::vector<Node> nodes_;
  std::unordered_map<std::string, Index> by_name_;
  std::unordered_map<std::string, std::vector<Index>> by_alias_;  // several: ambiguous
};

}  // namespace kpsa::engine
