#include "graph/plan_report.h"

#include <algorithm>
#include <map>
#include <utility>

namespace kpsa::engine {

std::vector<Index> Producers(const Plan& plan, Index step) {
  const Plan::Step& s = plan.steps()[step];
  std::vector<Index> producers(plan.deps().begin() + s.deps, plan.deps().begin() + s.deps + s.deps_count);
  if (s.branch != kNoIndex) {
    const std::vector<Index>& lazy = plan.branches()[s.branch].lazy_deps;
    producers.insert(producers.end(), lazy.begin(), lazy.end());
  }
  const auto steps = static_cast<Index>(plan.steps().size());
  std::erase_if(producers, [&](Index p) { return p >= steps || p == step; });
  std::sort(producers.begin(), producers.end());
  producers.erase(std::unique(producers.begin(), producers.end()), producers.end());
  return producers;
}

std::string SegmentName(const Plan& plan, Index segment) {
  if (segment == 0) return "always";
  // The owners of all that share it
  std::vector<std::string> names;
  std::vector<Index> open{segment};
  std::vector<bool> seen(plan.segments().size(), false);
  while (!open.empty()) {
    const Plan::Segment& g = plan.segments()[open.back()];
    open.pop_back();
    if (g.owner != kNoIndex) {
      const std::string name = plan.step_name(g.owner);
      if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
      continue;
    }
    for (const Index user : g.users) {
      if (!seen[user]) open.push_back(user), seen[user] = true;
    }
  }
  std::sort(names.begin(), names.end());
  if (names.size() == 1) return fmt::format("only if {} asks for it", names[0]);
  if (names.size() == 2) return fmt::format("only if {} or {} asks for it", names[0], names[1]);
  return fmt::format("only if {}, {} or {} more ask for it", names[0], names[1], names.size() - 2);
}

std::string NeededBy(const Plan& plan, Index step) {
  std::vector<std::string> names;
  for (Index consumer : plan.consumers(step)) {
    const std::string name = plan.step_name(consumer);
    if (name != plan.step_name(step) && std::find(names.begin(), names.end(), name) == names.end())
      names.push_back(name);
  }
  for (const Plan::Output& output : plan.outputs()) {
    if (output.producer == step) names.insert(names.begin(), "the request");
  }
  if (names.size() > 3) return fmt::format("{}, {} and {} more", names[0], names[1], names.size() - 2);
  return fmt::format("{}", fmt::join(names, ", "));
}

std::string StepName(const Plan& plan, Index step) {
  const std::string label = plan.step_label(step);
  return label.empty() ? plan.step_name(step) : fmt::format("{} ({})", plan.step_name(step), label);
}

std::vector<NodeTime> NodeTimes(const Plan& plan, const Profile& profile) {
  std::vector<NodeTime> nodes;
  std::map<std::pair<std::string, Index>, std::size_t> by_name;
  const auto count = static_cast<Index>(plan.steps().size());
  for (Index s = 0; s < count; ++s) {
    const Plan::StepInfo& info = plan.infos()[s];
    const auto [it, added] =
        by_name.emplace(std::make_pair(std::string(plan.step_name(s)), info.segment), nodes.size());
    if (added)
      nodes.push_back(
          {plan.step_name(s), plan.step_type(s), SegmentName(plan, info.segment), {}, 0, 0, 0, 0, 0});
    NodeTime& node = nodes[it->second];
    node.steps.push_back(s);
    node.count += profile.counts()[s];
    node.self_ns += static_cast<double>(profile.self_ns()[s]);
    node.points = std::max(node.points, info.points);
    node.points_total = std::max(node.points_total, info.points_total);
  }
  // Upstream of each node, every step counted once: a walk a node
  std::vector<Index> mark(count, kNoIndex), stack;
  for (Index n = 0; n < nodes.size(); ++n) {
    stack = nodes[n].steps;
    for (Index s : stack) mark[s] = n;
    while (!stack.empty()) {
      const Index s = stack.back();
      stack.pop_back();
      nodes[n].inclusive_ns += static_cast<double>(profile.self_ns()[s]);
      for (Index p : Producers(plan, s)) {
        if (mark[p] != n) stack.push_back(p), mark[p] = n;
      }
    }
  }
  std::stable_sort(nodes.begin(), nodes.end(),
                   [](const NodeTime& a, const NodeTime& b) { return a.self_ns > b.self_ns; });
  return nodes;
}

CriticalPath FindCriticalPath(const Plan& plan, const Profile& profile) {
  const auto count = static_cast<Index>(plan.steps().size());
  std::vector<double> longest(count, -1);
  std::vector<Index> previous(count, kNoIndex), stack;
  // Producers may stand behind their consumers in other segments, so this is a walk, not a sweep
  for (Index root = 0; root < count; ++root) {
    stack.push_back(root);
    while (!stack.empty()) {
      const Index s = stack.back();
      if (longest[s] >= 0) {
        stack.pop_back();
        continue;
      }
      bool ready = true;
      double before = 0;
      for (Index p : Producers(plan, s)) {
        if (longest[p] < 0) {
          stack.push_back(p);
          ready = false;
        } else if (longest[p] > before) {
          before = longest[p];
          previous[s] = p;
        }
      }
      if (!ready) continue;
      longest[s] = before + static_cast<double>(profile.self_ns()[s]);
      stack.pop_back();
    }
  }
  CriticalPath path;
  if (count == 0) return path;
  Index last = static_cast<Index>(std::max_element(longest.begin(), longest.end()) - longest.begin());
  path.ns = longest[last];
  for (; last != kNoIndex; last = previous[last]) path.steps.push_back(last);
  std::reverse(path.steps.begin(), path.steps.end());
  return path;
}

}  // namespace kpsa::engine
