// Points near the origin wherever a character stands. Points are floats in world space: 100 km from the
// origin they are 8 mm apart, and cues would be noise. A near stack is a copy of the world-space deformers
// that lead to some points, moved back by as much as a space has moved since rest: the joints' matrices,
// which are double, are moved before they meet a float.
#pragma once

#include <map>
#include <optional>
#include <tuple>
#include <utility>

#include "kpsa/accelerate.h"

namespace kpsa::engine {

class NearStacks {
 public:
  // space_world: the worldMatrix of the space; rest_origin: where it is at rest.
  NearStacks(Graph* graph, const AccelerationTarget& target, const PlugRef& space_world, Double3 rest_origin);
  // The same points, less what the space has moved since rest: world + (rest_origin - origin now). Nothing
  // where the stack has a world matrix or points whose space is not known; the graph is then as it was but
  // for nodes that nobody reads.
  std::optional<PlugRef> Near(const PlugRef& points);

 private:
  std::optional<PlugRef> Copy(const PlugRef& points);
  bool SkinsInPart(NodeId skin) const;
  bool CopyInput(const PlugRef& from, const Connection& connection, const PlugRef& to);
  std::optional<PlugRef> NearMatrix(const PlugRef& source);

  Graph* graph_;
  std::map<std::pair<Index, int>, bool>
      world_;                       // stages by node and element: whether they are in world space
  std::map<Index, NodeId> copies_;  // by node
  std::map<std::tuple<Index, int, int>, PlugRef> matrices_;
  std::vector<PlugRef> varying_;
  PlugRef offset_;  // of the node that compares the space with rest
};

// Declares spaceOffset and offsetMatrix.
void AddNearNodes(NodeRegistry& registry);

}  // namespace kpsa::engine
