#include "kpsa/signals.h"

#include <algorithm>
#include <charconv>
#include <map>
#include <set>

#include "base/check.h"

namespace kpsa::engine {
namespace {

bool IsTransform(const NodeDef& def) {
  return def.FindAttribute("worldMatrix") >= 0 && def.FindAttribute("parentMatrix") >= 0 &&
         def.FindAttribute("matrix") >= 0;
}

}  // namespace

std::vector<NodeId> ParentsFrom(const Graph& graph, NodeId node) {
  std::vector<NodeId> chain;
  while (graph.IsAlive(node) && std::find(chain.begin(), chain.end(), node) == chain.end()) {
    chain.push_back(node);
    const int parent = graph.def(node).FindAttribute("parentMatrix");
    if (parent < 0) break;
    const Connection* c = graph.FindConnection({node, parent, -1, -1});
    if (c == nullptr) break;
    node = c->source.node;
  }
  return chain;
}

void MatrixEntries(const Matrix4& m, double entries[12]) {
  for (int column = 0; column < 4; ++column) {
    for (int row = 0; row < 3; ++row) entries[3 * column + row] = m(row, column);
  }
}

std::string EntryName(const Signal& signal, std::size_t entry) {
  return signal.matrix ? fmt::format("{}/{}", signal.name, entry) : signal.name;
}

SignalEntry SplitEntryName(const std::string& name) {
  const std::size_t slash = name.rfind('/');
  if (slash == std::string::npos) return {name, std::nullopt};
  std::size_t entry = 0;
  const char* const end = name.data() + name.size();
  const auto [stop, error] = std::from_chars(name.data() + slash + 1, end, entry);
  if (stop != end || error != std::errc()) return {name, std::nullopt};
  return {name.substr(0, slash), entry};
}

bool IsWorldMatrix(const Graph& graph, const PlugRef& plug) {
  const NodeDef& def = graph.def(plug.node);
  return IsTransform(def) && plug.attribute == def.FindAttribute("worldMatrix");
}

Result<std::vector<Signal>> FindRelativeMatrices(const Graph& graph, Compiler* compiler,
                                                 const std::vector<PlugRef>& outputs,
                                                 const std::vector<PlugRef>& varying) {
  Request request;
  for (const PlugRef& output : outputs) request.outputs.push_back({output, {}});
  request.varying = varying;
  const auto steps = compiler->Steps(graph, request);
  if (!steps.ok()) return steps.status();
  std::set<Index> nodes, with_points;
  for (const Compiler::Stepped& stepped : *steps) {
    nodes.insert(stepped.node.index);
    if (stepped.points) with_points.insert(stepped.node.index);
  }
  std::map<std::string, Signal> found, still;
  for (const Index index : with_points) {
    for (const Connection& c : graph.Inputs(graph.IdAt(index))) {
      if (!IsWorldMatrix(graph, c.source)) continue;
      const std::string name = graph.PlugName(c.source);
      (nodes.count(c.source.node.index) > 0 ? found : still)
          .emplace(name, Signal{name, c.source, true, true});
    }
  }
  // Relative to a space that moves, they all move by the same matrix; but one that moves no point may vary all the same
  for (const auto& [name, signal] : still) {
    Request alone;
    alone.outputs.push_back({signal.plug, {}});
    alone.varying = varying;
    const auto of_it = compiler->Steps(graph, alone);
    if (!of_it.ok()) return of_it.status();
    if (!of_it->empty()) continue;
    found.emplace(name, signal);
    break;
  }
  std::vector<Signal> sorted;
  for (auto& [name, signal] : found) sorted.push_back(std::move(signal));
  return sorted;
}

Result<std::vector<Signal>> FindSignals(const Graph& graph, Compiler* compiler,
                                        const std::vector<PlugRef>& outputs,
                                        const std::vector<PlugRef>& varying, const std::set<Index>& carried,
                                        std::vector<std::string>* unguarded) {
  Request request;
  for (const PlugRef& output : outputs) request.outputs.push_back({output, {}});
  request.varying = varying;
  const auto steps = compiler->Steps(graph, request);
  if (!steps.ok()) return steps.status();
  return FindSignals(graph, *steps, varying, carried, unguarded);
}

Result<std::vector<Signal>> FindSignals(const Graph& graph, const std::vector<Compiler::Stepped>& steps,
                                        const std::vector<PlugRef>& varying, const std::set<Index>& carried,
                                        std::vector<std::string>* unguarded) {
  // Nodes that have a varying step, and whether one of them has points
  std::map<Index, bool> nodes;
  for (const Compiler::Stepped& stepped : steps) {
    if (graph.def(stepped.node).stateful) {
      return Status::Invalid(
          "\"{}\" remembers its previous frame, and a subspace knows poses only: points after it cannot be "
          "accelerated; accelerate a stage before it",
          graph.name(stepped.node));
    }
    nodes[stepped.node.index] = stepped.points;
  }
  std::set<Index> varying_nodes;
  for (const PlugRef& plug : varying) varying_nodes.insert(plug.node.index);

  std::map<std::string, Signal> signals;
  const auto name = [&](const PlugRef& plug, bool is_matrix) {
    std::string known = graph.PlugName(plug);
    const auto [place, is_new] = signals.try_emplace(std::move(known));
    if (is_new) place->second = Signal{place->first, plug, is_matrix};
  };
  const auto add = [&](const PlugRef& plug, Type type) {
    if (type == Type::kDouble3 || type == Type::kQuaternion) {
      for (int c = 0; c < (type == Type::kDouble3 ? 3 : 4); ++c) {
        PlugRef child = plug;
        child.component = c;
        name(child, false);
      }
    } else if (IsSmallType(type) && type != Type::kMatrix) {
      name(plug, false);
    } else if (IsPointType(type) && unguarded != nullptr && varying_nodes.count(plug.node.index) != 0) {
      unguarded->push_back(graph.PlugName(plug));
    }
  };
  // A matrix that varies, unless transforms make it, whose own matrices stand for it
  const auto add_matrix = [&](const PlugRef& source) {
    if (IsTransform(graph.def(source.node)) || graph.PlugType(source) != Type::kMatrix) return;
    if (nodes.count(source.node.index) == 0 && varying_nodes.count(source.node.index) == 0) return;
    name(source, true);
  };
  for (const auto& [index, has_points] : nodes) {
    const NodeId node = graph.IdAt(index);
    const NodeDef& def = graph.def(node);
    if (IsTransform(def) && !has_points) {
      if (carried.count(index) != 0) continue;
      name({node, def.FindAttribute("matrix"), -1, -1}, true);
      // A parent that is no transform has no local matrix of its own
      const PlugRef parent{node, def.FindAttribute("parentMatrix"), -1, -1};
      if (const Connection* c = graph.FindConnection(parent)) add_matrix(c->source);
    }
    if (!has_points) continue;
    for (const Connection& c : graph.Inputs(node)) {
      const Type type = graph.PlugType(c.destination);
      if (IsPointType(type)) continue;
      if (nodes.count(c.source.node.index) == 0 && varying_nodes.count(c.source.node.index) == 0) continue;
      if (type == Type::kMatrix) {
        add_matrix(c.source);
        continue;
      }
      // A single point of an array has no plug to read: its driver stands for it
      const AttributeDef& to = def.attributes[static_cast<std::size_t>(c.destination.attribute)];
      if (to.diagnostic) continue;
      if (IsPointType(to.type)) {
        add(c.source, graph.PlugType(c.source));
      } else {
        add(c.destination, type);
      }
    }
    for (const PlugRef& plug : varying) {
      if (plug.node == node && graph.PlugType(plug) == Type::kMatrix) add_matrix(plug);
      if (plug.node == node && !def.attributes[static_cast<std::size_t>(plug.attribute)].diagnostic)
        add(plug, graph.PlugType(plug));
    }
  }
  std::vector<Signal> sorted;
  for (auto& [known, signal] : signals) sorted.push_back(std::move(signal));
  return sorted;
}

}  // namespace kpsa::engine
