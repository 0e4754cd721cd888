#include "graph/explain.h"

#include <algorithm>

#include "base/text.h"
#include "graph/plan_report.h"

namespace kpsa::engine {

std::string PointsText(const Plan::StepInfo& info) {
  if (info.points_total == 0) return "no points";
  if (info.points == info.points_total) return fmt::format("all {} points", Thousands(info.points_total));
  return fmt::format("{} of {} points", Thousands(info.points), Thousands(info.points_total));
}

std::string CauseChain(const Plan& plan, const Profile& profile, Index step) {
  const auto steps = static_cast<Index>(plan.steps().size());
  std::vector<std::string> chain = {StepName(plan, step)};
  for (std::size_t guard = 0; guard < steps && step < steps; ++guard) {
    const Index cause = profile.last_cause()[step];
    if (cause == kNoIndex) break;
    if (const std::string name = CauseName(plan, cause); name != chain.back()) chain.push_back(name);
    step = cause;
  }
  std::reverse(chain.begin(), chain.end());
  if (chain.size() > 10)
    chain.erase(chain.begin() + 4, chain.end() - 4), chain.insert(chain.begin() + 4, "...");
  return fmt::format("{}", fmt::join(chain, " > "));
}

std::string NeedChain(const Plan& plan, Index step) {
  const auto steps = static_cast<Index>(plan.steps().size());
  const auto wanted = [&](Index s) {
    return std::any_of(plan.outputs().begin(), plan.outputs().end(),
                       [&](const Plan::Output& o) { return o.producer == s; });
  };
  std::vector<Index> from(steps, kNoIndex), queue = {step};
  for (std::size_t i = 0; i < queue.size(); ++i) {
    const Index s = queue[i];
    if (wanted(s)) {
      std::vector<std::string> chain = {"the request"};
      for (Index at = s; at != step; at = from[at])
        chain.push_back(fmt::format("{} ({})", plan.step_name(at), PointsText(plan.infos()[at])));
      std::reverse(chain.begin(), chain.end());
      if (chain.size() > 8)
        chain.erase(chain.begin() + 3, chain.end() - 3), chain.insert(chain.begin() + 3, "...");
      return fmt::format("{}", fmt::join(chain, " > "));
    }
    for (Index consumer : plan.consumers(s)) {
      if (from[consumer] == kNoIndex && consumer != step) from[consumer] = s, queue.push_back(consumer);
    }
  }
  return "nothing that was asked for";
}

std::string MaskText(const Plan& plan, Index step) {
  const Plan::StepInfo& info = plan.infos()[step];
  if (info.points_total == 0) return "it has no points to leave out";
  const Plan::StepInfo* largest = nullptr;
  Index reader = kNoIndex;
  for (Index consumer : plan.consumers(step)) {
    const Plan::StepInfo& other = plan.infos()[consumer];
    if (largest == nullptr || other.points > largest->points) largest = &other, reader = consumer;
  }
  const bool asked = std::any_of(plan.outputs().begin(), plan.outputs().end(), [&](const Plan::Output& o) {
    return o.producer == step && o.points.size() == info.points;
  });
  if (asked) return fmt::format("the request asks for {}", PointsText(info));
  if (largest == nullptr) return PointsText(info);
  if (info.points <= largest->points) return fmt::format("{} reads the same points", plan.step_name(reader));
  return fmt::format("{} computes {} and needs {} of this to do so", plan.step_name(reader),
                     PointsText(*largest), Thousands(info.points));
}

}  // namespace kpsa::engine
