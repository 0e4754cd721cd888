#include "host/node_outline.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "base/text.h"
#include "graph/plan_report.h"
#include "host/bench/side.h"

namespace kpsa::engine {
namespace {

using State = OutlinedNode::State;

bool IsHelper(const Plan& plan, Index step) { return *plan.step_label(step) != 0; }

// What one plan says of a node, its steps taken together.
struct Seen {
  bool always = false, lazy = false;  // it has steps that run in every frame, and others
  bool for_cues = false;              // of the former: all are points that KPSA nodes read
  Index points = 0, always_points = 0, total = 0;
  std::string needed_by, segment;  // of the step that says most
};

std::map<std::string, Seen> LookAt(const Plan& plan, const std::vector<AppliedSubspace>& applied) {
  std::vector<NodeId> kpsa_nodes;
  for (const AppliedSubspace& one : applied) kpsa_nodes.push_back(one.node);
  const std::vector<char> above = PointStepsAbove(plan, kpsa_nodes);
  std::map<std::string, Seen> seen;
  for (Index s = 0; s < plan.steps().size(); ++s) {
    const Plan::StepInfo& info = plan.infos()[s];
    if (IsHelper(plan, s)) continue;
    Seen& node = seen[plan.step_name(s)];
    const bool is_kpsa = std::ranges::find(kpsa_nodes, info.node) != kpsa_nodes.end();
    node.points = std::max(node.points, info.points), node.total = std::max(node.total, info.points_total);
    if (info.segment != 0) {
      node.lazy = true;
      if (!node.always) node.segment = SegmentName(plan, info.segment);
      continue;
    }
    node.for_cues = (!node.always || node.for_cues) && above[s] != 0 && !is_kpsa;
    node.always_points = std::max(node.always_points, info.points);
    node.always = true;
    node.segment = SegmentName(plan, info.segment), node.needed_by = NeededBy(plan, s);
  }
  return seen;
}

bool HasEnvelope(const Graph& graph, NodeId node) { return graph.def(node).FindAttribute("envelope") >= 0; }

// Why a plan has no step of a node; "" where it has, or where nobody asks for it.
std::map<std::string, std::string> LeftOut(const Plan& plan) {
  std::map<std::string, std::string> reasons;
  for (const Plan::Excluded& excluded : plan.excluded()) reasons[excluded.node_name] = excluded.reason;
  return reasons;
}

bool IsPassedBy(const std::string& reason) {
  return reason.starts_with("hands on") || reason.starts_with("moves none");
}

void Tell(const Seen& seen, OutlinedNode* node) {
  node->points = seen.total;
  node->state = !seen.always ? State::kNeverRun : seen.for_cues ? State::kCuesOnly : State::kKept;
  node->reason = node->state == State::kNeverRun ? "runs " + seen.segment
                 : node->state == State::kCuesOnly
                     ? fmt::format("{} of {} points, needed by {}", Thousands(seen.always_points),
                                   Thousands(seen.total), seen.needed_by)
                     : "needed by " + seen.needed_by;
}

// Inputs by node, listed ones alone, without the edges that would close a cycle.
class Edges {
 public:
  Edges(const Graph& graph, const std::map<Index, std::size_t>& listed) : graph_(graph), listed_(listed) {}

  // Of listed nodes: those that feed it, through any number of nodes that are not listed.
  std::set<std::size_t> Into(NodeId node) const {
    std::set<std::size_t> found;
    std::set<Index> visited{node.index};
    std::vector<NodeId> stack{node};
    while (!stack.empty()) {
      const NodeId at = stack.back();
      stack.pop_back();
      for (const Connection& connection : graph_.Inputs(at)) {
        const NodeId source = connection.source.node;
        if (!visited.insert(source.index).second) continue;
        const auto it = listed_.find(source.index);
        if (it == listed_.end()) {
          stack.push_back(source);
        } else {
          found.insert(it->second);
        }
      }
    }
    return found;
  }

 private:
  const Graph& graph_;
  const std::map<Index, std::size_t>& listed_;
};

// Leaves out every edge to a node that is being visited: what remains has an order.
void BreakCycles(std::vector<OutlinedNode>* nodes) {
  enum : char { kNew, kOpen, kDone };
  std::vector<char> mark(nodes->size(), kNew);
  for (std::size_t root = 0; root < nodes->size(); ++root) {
    if (mark[root] != kNew) continue;
    std::vector<std::pair<std::size_t, std::size_t>> stack{{root, 0}};  // node, next input
    mark[root] = kOpen;
    while (!stack.empty()) {
      auto& [node, next] = stack.back();
      std::vector<std::size_t>& inputs = (*nodes)[node].inputs;
      if (next == inputs.size()) {
        mark[node] = kDone;
        stack.pop_back();
      } else if (mark[inputs[next]] == kOpen) {
        inputs.erase(inputs.begin() + static_cast<std::ptrdiff_t>(next));
      } else {
        const std::size_t input = inputs[next++];
        if (mark[input] == kNew) mark[input] = kOpen, stack.emplace_back(input, 0);
      }
    }
  }
}

}  // namespace

const char* StateName(OutlinedNode::State state) {
  constexpr const char* kNames[] = {"kept", "cues only", "never run", "switched off"};
  return kNames[static_cast<int>(state)];
}

std::vector<OutlinedNode> OutlineNodes(const Graph& graph, const Plan& full, const Plan* accelerated,
                                       const std::vector<AppliedSubspace>& applied) {
  const std::map<std::string, Seen> in_full = LookAt(full, {});
  const std::map<std::string, Seen> in_plan =
      accelerated == nullptr ? in_full : LookAt(*accelerated, applied);
  const std::map<std::string, std::string> left_out = LeftOut(full);
  std::vector<OutlinedNode> nodes;
  std::map<Index, std::size_t> listed;
  std::vector<NodeId> ids;
  for (const NodeId id : graph.Nodes()) {
    OutlinedNode node;
    node.name = graph.name(id), node.type = graph.def(id).name;
    const auto there = in_plan.find(node.name), fully = in_full.find(node.name);
    const auto excluded = left_out.find(node.name);
    if (there != in_plan.end()) {
      Tell(there->second, &node);
    } else if (fully != in_full.end()) {
      Tell(fully->second, &node);
      node.state = State::kNeverRun, node.reason = "the full evaluation alone has it";
    } else if (excluded != left_out.end() && IsPassedBy(excluded->second) && HasEnvelope(graph, id)) {
      node.state = State::kSwitchedOff, node.reason = excluded->second;
    } else {
      continue;
    }
    listed[id.index] = nodes.size();
    ids.push_back(id);
    nodes.push_back(std::move(node));
  }
  const Edges edges(graph, listed);
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    const std::set<std::size_t> inputs = edges.Into(ids[n]);
    nodes[n].inputs.assign(inputs.begin(), inputs.end());
    std::erase(nodes[n].inputs, n);
  }
  BreakCycles(&nodes);
  return nodes;
}

}  // namespace kpsa::engine
