#include "host/explain/node_story.h"

#include <fmt/format.h>

#include "graph/explain.h"
#include "graph/plan_report.h"

namespace kpsa::engine {
namespace {

// Why a step that is in the plan did not run; "" where it did.
std::string NotEvaluated(const Plan& plan, const Profile& profile, Index step) {
  if (profile.counts()[step] > 0) return "";
  const Plan::StepInfo& info = plan.infos()[step];
  if (info.segment != 0) return fmt::format("it runs {}", SegmentName(plan, info.segment));
  return "nothing that it reads has changed since the frame before";
}

}  // namespace

std::string SourceOfValue(const Rig& rig, const PlugRef& plug) {
  const Graph& graph = *rig.graph;
  PlugRef whole = plug;
  whole.component = -1;
  for (const PlugRef& p : {plug, whole}) {
    if (const Connection* driver = graph.FindConnection(p))
      return fmt::format("driven by {}", graph.PlugName(driver->source));
  }
  if (const Value* value = graph.FindValue(plug)) return fmt::format("set to {}", value->ToString());
  const AttributeDef& attribute = graph.def(plug.node).attributes[static_cast<std::size_t>(plug.attribute)];
  return attribute.output ? "an output"
                          : fmt::format("at its default, {}", attribute.default_value.ToString());
}

NodeStory TellOfNode(const Rig& rig, const Plan& plan, const Profile& profile, NodeId node,
                     const std::string& attribute, std::size_t frames) {
  NodeStory story;
  story.name = rig.graph->name(node);
  story.type = rig.graph->def(node).name;
  story.attribute = attribute;
  story.frames = frames;
  for (Index s = 0; s < plan.steps().size(); ++s) {
    const Plan::StepInfo& info = plan.infos()[s];
    if (info.node != node) continue;
    story.steps.push_back({StepName(plan, s), SegmentName(plan, info.segment), profile.counts()[s],
                           info.points, info.points_total, PointsText(info),
                           profile.counts()[s] > 0 ? CauseChain(plan, profile, s) : "",
                           NotEvaluated(plan, profile, s), NeedChain(plan, s), MaskText(plan, s)});
  }
  for (const Plan::Excluded& e : plan.excluded()) {
    if (e.node_name == story.name) story.left_out = e.reason;
  }
  if (story.steps.empty() && story.left_out.empty()) story.left_out = "it only holds what may vary";
  return story;
}

}  // namespace kpsa::engine
