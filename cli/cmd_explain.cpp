// kpsa explain: why a node was evaluated, and why it could not be masked or skipped.
#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/acceleration.h"
#include "cli/frames_range.h"
#include "cli/options.h"
#include "cli/request.h"
#include "cli/rig_frames.h"
#include "graph/explain.h"
#include "graph/plan_report.h"

namespace kpsa {
namespace {

struct ExplainFlags : Flags {
  AccelerationFlags acceleration;
  std::string what;
  std::vector<std::string> wanted;
  std::optional<std::string> vertices;
};

std::string DriverText(const Rig& rig, const PlugRef& plug) {
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

struct Target {
  NodeId node;
  std::string attribute;  // text about it, "" where only a node was named
};

Result<Target> FindTarget(const Rig& rig, const std::string& what) {
  if (const Result<NodeId> node = rig.graph->FindNode(what); node.ok()) return Target{*node, ""};
  const Result<PlugRef> plug = rig.graph->FindPlug(what);
  if (plug.ok())
    return Target{plug->node, fmt::format("{} is {}", rig.graph->PlugName(*plug), DriverText(rig, *plug))};
  // A word without a dot was meant as a node
  const Status status =
      what.find('.') == std::string::npos ? rig.graph->FindNode(what).status() : plug.status();
  return AsUsage(status);
}

CommandResult Explain(const ExplainFlags& flags) {
  KPSA_RETURN_IF_ERROR(CheckTimeFlags(flags));
  KPSA_RETURN_IF_ERROR(CheckAccelerationFlags(flags.acceleration, flags.acceleration.wanted()));
  const Result<std::unique_ptr<OpenRig>> open = LoadRigOf(flags);
  if (!open.ok()) return open.status();
  Rig& rig = (*open)->rig;
  Compiler compiler;
  if (flags.acceleration.wanted())
    KPSA_RETURN_IF_ERROR(ApplyAcceleration(&rig, &compiler, flags.acceleration).status());
  const Result<Target> target = FindTarget(rig, flags.what);
  if (!target.ok()) return target.status();
  const Result<Request> request = BuildRequest(rig, flags.wanted, flags.vertices);
  if (!request.ok()) return request.status();
  const auto compiled = CompileFor(rig, &compiler, *request);
  if (!compiled.ok()) return compiled.status();
  const Plan& plan = **compiled;
  const Result<std::vector<double>> times = SampleTimes(flags, rig);
  if (!times.ok()) return times.status();
  const InterruptScope interruptible;
  Profile profile(plan);
  RigFrameOptions options;
  options.threads = 1;
  options.profile = &profile;
  KPSA_RETURN_IF_ERROR(
      EvaluateTimes(rig, *compiled, *times, options, [](std::size_t, const Evaluator&) { return Status(); }));

  const std::string name = rig.graph->name(target->node);
  std::vector<Index> steps;
  for (Index s = 0; s < plan.steps().size(); ++s) {
    if (plan.infos()[s].node == target->node) steps.push_back(s);
  }
  std::string left_out;
  for (const Plan::Excluded& e : plan.excluded()) {
    if (e.node_name == name) left_out = e.reason;
  }
  if (steps.empty() && left_out.empty()) left_out = "it only holds what may vary";
  if (flags.json) {
    nlohmann::ordered_json rows = nlohmann::ordered_json::array();
    for (Index s : steps) {
      rows.push_back({{"step", StepName(plan, s)},
                      {"segment", SegmentName(plan, plan.infos()[s].segment)},
                      {"count", profile.counts()[s]},
                      {"points", plan.infos()[s].points},
                      {"points_total", plan.infos()[s].points_total},
                      {"dirtied_by", CauseChain(plan, profile, s)},
                      {"needed_by", NeedChain(plan, s)},
                      {"mask", MaskText(plan, s)}});
    }
    PrintJson(nlohmann::ordered_json{{"schema", "kpsa.explain/1"},
                                     {"node", name},
                                     {"type", rig.graph->def(target->node).name},
                                     {"attribute", target->attribute},
                                     {"frames", times->size()},
                                     {"left_out", left_out},
                                     {"steps", rows}});
    return 0;
  }
  Print(fmt::format("{} ({})\n", name, rig.graph->def(target->node).name));
  if (!target->attribute.empty()) Print("  " + target->attribute + "\n");
  if (steps.empty()) Print("  is not evaluated: " + left_out + "\n");
  for (Index s : steps) {
    Print(fmt::format("  {}: {}, evaluated in {} of {}, {}\n", StepName(plan, s), PointsText(plan.infos()[s]),
                      Thousands(profile.counts()[s]), Plural(times->size(), "frame"),
                      SegmentName(plan, plan.infos()[s].segment)));
    if (profile.counts()[s] > 0) Print(fmt::format("    dirtied by  {}\n", CauseChain(plan, profile, s)));
    Print(fmt::format("    needed by   {}\n    points      {}\n", NeedChain(plan, s), MaskText(plan, s)));
  }
  return 0;
}

}  // namespace

void AddExplainCommand(CLI::App* program, Command* chosen) {
  auto flags = std::make_shared<ExplainFlags>();
  CLI::App* command = AddCommand(
      program, "explain", "Why a node is evaluated, what dirtied it, why it is not masked or skipped",
      "Evaluates the clip, or the frames that are chosen, and tells of the last evaluation.\n"
      "Examples:\n"
      "  kpsa explain head.yaml mush\n"
      "  kpsa explain head.yaml jaw.rotateX --clip face_talk\n"
      "  kpsa explain head.yaml mush --accelerate",
      chosen, [flags] { return Explain(*flags); });
  AddRigFlags(command, flags.get());
  AddRequired(command, "NODE", &flags->what, "a node, or a plug (node.attr)");
  AddTimeFlags(command, flags.get());
  AddRepeated(command, "--want", "PLUG", &flags->wanted,
              "a plug or a mesh's points (head_mesh@mush) instead of all meshes; may be repeated");
  AddOption(command, "--vertices", "LIST", &flags->vertices,
            "only some vertices of the wanted meshes, as in 0:99,120");
  AddAccelerationFlags(command, &flags->acceleration);
  AddJsonFlag(command, flags.get());
}

}  // namespace kpsa
