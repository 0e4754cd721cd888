#include "kpsa/training/branches.h"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

namespace kpsa::engine {
namespace {

constexpr std::size_t kLimbs = 5;

// The first branch up the matrices that go into a node; nodes are looked at once, the nearest first.
std::optional<std::size_t> BranchAbove(const Graph& graph, NodeId of,
                                       const std::map<Index, std::size_t>& by_node) {
  std::vector<NodeId> reached = {of};
  std::set<Index> seen = {of.index};
  for (std::size_t at = 0; at < reached.size(); ++at) {
    for (const Connection& c : graph.Inputs(reached[at])) {
      if (graph.PlugType(c.source) != Type::kMatrix || !seen.insert(c.source.node.index).second) continue;
      if (const auto found = by_node.find(c.source.node.index); found != by_node.end()) return found->second;
      reached.push_back(c.source.node);
    }
  }
  return std::nullopt;
}

}  // namespace

std::vector<Branch> BranchesOf(const Graph& graph, const std::vector<ControlRange>& controls) {
  std::vector<Branch> branches;
  std::map<Index, std::size_t> by_node;
  for (std::size_t c = 0; c < controls.size(); ++c) {
    if (c == 0 || !OfOneNode(controls[c - 1], controls[c])) {
      by_node.emplace(controls[c].plug.node.index, branches.size());
      branches.push_back({.begin = c, .end = c});
    }
    branches.back().end = c + 1;
  }
  for (Branch& branch : branches) {
    const PlugRef& plug = controls[branch.begin].plug;
    if (plug.element < 0) branch.above = BranchAbove(graph, plug.node, by_node);
  }
  return branches;
}

std::vector<bool> StillBranches(std::span<const Branch> branches, Random* random) {
  std::vector<bool> still(branches.size());
  std::map<std::size_t, std::vector<std::size_t>> below;
  for (std::size_t b = 0; b < branches.size(); ++b) {
    if (branches[b].above) below[*branches[b].above].push_back(b);
  }
  for (auto& [above, some] : below) {
    for (std::size_t k = 0; k < kLimbs && k + 1 < some.size(); ++k)
      std::swap(some[k], some[k + random->Below(some.size() - k)]);
    for (std::size_t k = kLimbs; k < some.size(); ++k) still[some[k]] = true;
  }
  // What hangs from them, from each branch up to one that is told already
  std::vector<bool> told = still;
  std::vector<std::size_t> path;
  for (std::size_t b = 0; b < branches.size(); ++b) {
    path.clear();
    std::optional<std::size_t> at = b;
    for (; at && !told[*at]; at = branches[*at].above) {
      told[*at] = true;
      path.push_back(*at);
    }
    for (const std::size_t on : path) still[on] = at && still[*at];
  }
  return still;
}

}  // namespace kpsa::engine
