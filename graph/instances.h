// The compiler's first pass: which groups of which nodes a request reaches, in topological order, with the
// source of every input resolved. Internal to graph/.
#pragma once

#include <cstdint>
#include <deque>
#include <unordered_map>
#include <vector>

#include "graph/graph.h"
#include "graph/plan.h"

namespace kpsa::engine {

// Where an input's value comes from.
struct Source {
  enum class Kind : std::uint8_t { kValue, kVarying, kInstance };
  Kind kind = Kind::kValue;
  std::int8_t component = -1;    // of the slot, for a child plug of a double3 or quaternion
  const Value* value = nullptr;  // kValue; also the rest value of kVarying. Never null then.
  Index varying = kNoIndex;      // kVarying: index into Request::varying's whole plugs
  Index instance = kNoIndex;     // kInstance
  int output = 0, element = 0;   // kInstance: position in the group's outputs, element of an array output
  Type type = Type::kDouble;     // of the source slot, after taking the component
};

// An element of an input attribute, with its sources now and in the rest state.
struct Input {
  int position = 0;  // in the group's inputs
  int element = -1;  // of an array
  bool lazy = false;
  Source source, rest;
};

// A structural attribute that a connection drives.
struct StructuralInput {
  int attribute = 0, element = -1;
  Source source;
};

// One run of a group: of a node, of a geometry of it, or of one of the built-in helpers.
struct Instance {
  enum class Kind : std::uint8_t {
    kNode,
    kAssemble,  // whole value (input 0) with some children replaced (inputs 1..)
    kConvert,   // number types
  };
  Kind kind = Kind::kNode;
  bool varying = false;
  int group = 0;
  int geometry = -1;
  NodeId node;
  int attribute = -1;         // kAssemble: which input it serves
  Type type = Type::kDouble;  // kAssemble, kConvert: of the output
  std::vector<Input> inputs;
  std::vector<StructuralInput> structural;  // only those that are driven
  std::vector<int> children;  // kAssemble: for input 1 + i, element * 4 + component (component 3: all three)
  std::vector<int> array_sizes;   // by position in the group's inputs; 1 where it is no array
  std::vector<int> output_sizes;  // by position in the group's outputs
};

class InstanceTable {
 public:
  InstanceTable(const Graph& graph, const Request& request) : graph_(graph), request_(request) {}
  // Resolves a plug and all that is upstream of it.
  Source Reach(const PlugRef& plug);
  // Instance numbers, sources before consumers. Call after the last Reach.
  std::vector<Index> Order() const;

  const Graph& graph() const { return graph_; }
  std::vector<Instance>& instances() { return instances_; }
  const std::vector<Instance>& instances() const { return instances_; }
  const std::vector<PlugRef>& varying() const { return varying_; }  // whole plugs (components merged)
  const ComputeGroup& group(const Instance& i) const {
    return graph_.def(i.node).groups[static_cast<std::size_t>(i.group)];
  }
  const AttributeDef& input_def(const Instance& i, int position) const;
  const AttributeDef& output_def(const Instance& i, int position) const;
  Type OutputType(const Instance& i, int position) const;
  Index AddVarying(const PlugRef& plug);  // the number of its whole plug
  // The value that the graph holds for an input: set (children merged in), or the default. Never null.
  const Value* HeldValue(NodeId node, int attribute, int element, bool rest = false);
  // Whether the input, or a part of it, is set or driven.
  bool IsSet(NodeId node, int attribute, int element) const;
  // Elements that are set, connected or vary: the highest plus one.
  int ArraySize(NodeId node, int attribute) const;
  const Status& status() const { return status_; }  // the first error of set values

 private:
  struct Key {
    Index node;
    int a, b, c;
    friend bool operator==(const Key&, const Key&) = default;
  };
  struct KeyHash {
    std::size_t operator()(const Key& k) const {
      std::uint64_t h = k.node;
      for (int v : {k.a, k.b, k.c}) h = (h ^ static_cast<std::uint32_t>(v)) * 0x9e3779b97f4a7c15ull;
      return static_cast<std::size_t>(h ^ (h >> 29));
    }
  };
  // Resolve a plug without descending; new instances are put on the stack. An input takes over from what
  // drives it, through any number of inputs that drive each other.
  Source Resolve(PlugRef plug, bool rest);
  Source ResolveOutput(const PlugRef& plug);
  Source ResolveHeld(const PlugRef& plug, bool rest);  // of an input that no connection drives as a whole
  Source Assemble(const PlugRef& plug, const Source& whole, const std::vector<const Connection*>& children,
                  bool rest);
  Index InstanceOf(NodeId node, int group, int geometry);
  void Expand(Index instance);
  Source Take(Source source, int component);  // the child of a source
  Source ConvertTo(Source source, Type type, const PlugRef& plug, bool rest);
  const Connection* FindUsed(const PlugRef& destination, bool rest) const;
  const Value* Keep(Value value);
  Value WithSetPoints(const Value& whole, std::span<const SetValue> set);

  const Graph& graph_;
  const Request& request_;
  std::vector<Instance> instances_;
  std::vector<Index> pending_;
  std::unordered_map<Key, Index, KeyHash> by_key_;
  std::vector<PlugRef> varying_;
  std::unordered_map<Key, Index, KeyHash> varying_by_key_, held_by_key_;
  std::unordered_map<Key, int, KeyHash> varying_sizes_;  // of arrays with varying elements
  std::deque<Value> made_values_;
  Status status_;
};

}  // namespace kpsa::engine
