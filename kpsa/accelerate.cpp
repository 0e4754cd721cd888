#include "kpsa/accelerate.h"

#include <algorithm>
#include <set>

#include "kpsa/acceleration_draft.h"
#include "kpsa/near_stack.h"

namespace kpsa::engine {
namespace {

// All nodes that points depend on, their own included.
std::set<Index> NodesAbove(const Graph& graph, const std::vector<PlugRef>& points) {
  std::set<Index> above;
  std::vector<NodeId> stack;
  const auto visit = [&](NodeId node) {
    if (above.insert(node.index).second) stack.push_back(node);
  };
  for (const PlugRef& plug : points) visit(plug.node);
  while (!stack.empty()) {
    const NodeId node = stack.back();
    stack.pop_back();
    for (const Connection& c : graph.Inputs(node)) visit(c.source.node);
  }
  return above;
}

}  // namespace

std::vector<PlugRef> AccelerationTarget::outputs() const {
  std::vector<PlugRef> plugs;
  for (const MeshPoints& mesh : meshes) plugs.push_back(mesh.stages.back().points);
  return plugs;
}

// What belongs to a KPSA node before it is there.
struct Accelerator::Entry {
  AccelerationTarget target;
  AccelerateOptions options;
  std::string node_name;
  KpsaConfig::Data data;
  std::vector<PlugRef> cues;
  std::vector<Signal> matrices, scalars;
  std::vector<std::string> notes;
};

Status Accelerator::Add(const AccelerationTarget& target, std::shared_ptr<const Subspace> subspace,
                        const std::string& node_name, const AccelerateOptions& options) {
  Result<AccelerationDraft> draft =
      DraftAcceleration(*graph_, compiler_, target, std::move(subspace), options);
  if (!draft.ok()) return draft.status();
  entries_.push_back(std::make_shared<const Entry>(
      Entry{target, options, node_name, std::move(draft->data), std::move(draft->cues),
            std::move(draft->matrices), std::move(draft->scalars), std::move(draft->notes)}));
  return Status();
}

namespace {

// Who reads the points, but for what other accelerated points come from.
std::vector<std::vector<Connection>> ConsumersOf(const Graph& graph, const AccelerationTarget& target,
                                                 const std::set<Index>& above) {
  std::vector<std::vector<Connection>> consumers;
  for (const PlugRef& output : target.outputs()) {
    consumers.emplace_back();
    for (const Connection& c : graph.Outputs(output.node)) {
      if (c.source == output && above.count(c.destination.node.index) == 0) consumers.back().push_back(c);
    }
  }
  return consumers;
}

}  // namespace

Result<Accelerated> Accelerator::Rewrite(const Entry& entry, const std::set<Index>& above, Graph* graph) {
  Status status;
  const auto note = [&](Status s) { status.Append(std::move(s)); };
  const AccelerationTarget& target = entry.target;
  const std::vector<std::vector<Connection>> consumers = ConsumersOf(*graph, target, above);
  Result<NodeId> node = graph->AddNode("kpsa", entry.node_name);
  if (!node.ok()) return node.status();
  const NodeDef& def = graph->def(*node);
  const auto plug = [&](const char* name, int element = -1) {
    return PlugRef{*node, def.FindAttribute(name), element, -1};
  };
  KpsaConfig::Data data = entry.data;
  std::vector<PlugRef> cues = entry.cues;
  if (data.has_space && !data.always_miss) {
    NearStacks near(graph, target, target.space[0], data.rest_origin);
    for (std::size_t i = 0; i < cues.size(); ++i) {
      const std::optional<PlugRef> moved = data.cues[i].in_space ? near.Near(cues[i]) : std::nullopt;
      if (moved.has_value()) cues[i] = *moved, data.cues[i].near = true;
    }
  }
  const auto config = std::make_shared<const KpsaConfig>(std::move(data));
  const Subspace& subspace = *config->data().subspace;
  const AccelerateOptions& options = entry.options;
  note(graph->Set(plug("config"), Value(AssetPtr(config))));
  note(graph->Set(plug("tolerance"),
                  std::min(options.tolerance < 0 ? subspace.tolerance : options.tolerance, kAnyError)));
  note(graph->Set(plug("violationRate"),
                  options.violation_rate < 0 ? subspace.violation_rate : options.violation_rate));
  for (std::size_t i = 0; i < cues.size(); ++i)
    note(graph->Connect(cues[i], plug("cues", static_cast<int>(i))));
  for (std::size_t j = 0; j < entry.matrices.size(); ++j)
    note(graph->Connect(entry.matrices[j].plug, plug("matrices", static_cast<int>(j))));
  for (std::size_t k = 0; k < entry.scalars.size(); ++k)
    note(graph->Connect(entry.scalars[k].plug, plug("scalars", static_cast<int>(k))));
  if (!target.space.empty()) note(graph->Connect(target.space[0], plug("spaceMatrix")));
  std::vector<std::string> names;
  for (std::size_t m = 0; m < target.meshes.size(); ++m) {
    names.push_back(target.meshes[m].name);
    note(graph->Connect(target.meshes[m].stages.back().points, plug("fullPoints", static_cast<int>(m))));
  }
  const std::size_t regions = config->data().patches.empty() ? 0 : subspace.patches.regions.size();
  for (std::size_t r = 0; r < regions; ++r)
    note(graph->Connect(target.meshes[subspace.patches.regions[r].output].stages.back().points,
                        plug("regionPoints", static_cast<int>(r))));
  graph->SetElementNames(*node, def.FindAttribute("outPoints"), names);
  for (std::size_t m = 0; m < consumers.size(); ++m) {
    for (const Connection& c : consumers[m])
      note(graph->Connect(plug("outPoints", static_cast<int>(m)), c.destination, true));
  }
  if (!status.ok()) return status;
  return Accelerated{*node, config, entry.notes};
}

Result<std::vector<Accelerated>> Accelerator::Apply() {
  std::vector<PlugRef> points;
  for (const auto& entry : entries_) {
    for (const PlugRef& plug : entry->target.outputs()) points.push_back(plug);
  }
  const std::set<Index> above = NodesAbove(*graph_, points);
  Graph edited = *graph_;
  std::vector<Accelerated> results;
  for (const auto& entry : entries_) {
    Result<Accelerated> one = Rewrite(*entry, above, &edited);
    if (!one.ok()) return one.status();
    results.push_back(std::move(*one));
  }
  *graph_ = std::move(edited);
  return results;
}

Result<Accelerated> Accelerate(Graph* graph, Compiler* compiler, const AccelerationTarget& target,
                               std::shared_ptr<const Subspace> subspace, const std::string& node_name,
                               const AccelerateOptions& options) {
  Accelerator accelerator(graph, compiler);
  KPSA_RETURN_IF_ERROR(accelerator.Add(target, std::move(subspace), node_name, options));
  Result<std::vector<Accelerated>> applied = accelerator.Apply();
  if (!applied.ok()) return applied.status();
  return std::move(applied->front());
}

}  // namespace kpsa::engine
