// kpsa graph: the rig as a drawing, for Graphviz.
#include <algorithm>
#include <map>
#include <memory>
#include <set>

#include "cli/acceleration.h"
#include "cli/frames_range.h"
#include "cli/options.h"
#include "cli/output.h"
#include "cli/plan_report.h"
#include "cli/request.h"
#include "cli/rig_frames.h"

namespace kpsa {
namespace {

struct GraphFlags : Flags {
  AccelerationFlags acceleration;
  std::vector<std::string> wanted;
  std::optional<std::string> vertices;
  bool time = false, all = false;
};

// Within a quoted string of the DOT language.
std::string Escaped(const std::string& text) {
  std::string escaped;
  for (char c : text) {
    if (c == '"' || c == '\\') escaped += '\\';
    escaped += c == '\n' ? ' ' : c;
  }
  return escaped;
}
std::string Quoted(const std::string& text) { return "\"" + Escaped(text) + "\""; }

struct NodeLook {
  bool kept = false, lazy_only = true;
  Index points = 0, points_total = 0;
  double ns = 0;
  std::string left_out;  // reason
};

// From pale yellow (nothing) to red (all the time).
std::string HeatColor(double share) {
  const auto level = static_cast<int>(255 * (1 - std::min(1.0, std::max(0.0, share))));
  return fmt::format("#ff{:02x}{:02x}", 60 + level * 190 / 255, 40 + level * 160 / 255);
}

std::string Dot(const Rig& rig, const Plan& plan, const Profile* profile, std::size_t frames, bool all) {
  const Graph& graph = *rig.graph;
  std::map<std::string, NodeLook> looks;
  double total = 0;
  for (Index s = 0; s < plan.steps().size(); ++s) {
    NodeLook& look = looks[plan.step_name(s)];
    const Plan::StepInfo& info = plan.infos()[s];
    look.kept = true;
    look.lazy_only = look.lazy_only && info.segment != 0;
    if (info.points > look.points) look.points = info.points, look.points_total = info.points_total;
    if (profile != nullptr)
      look.ns += static_cast<double>(profile->self_ns()[s]),
          total += static_cast<double>(profile->self_ns()[s]);
  }
  for (const Plan::Excluded& e : plan.excluded()) looks[e.node_name].left_out = e.reason;
  for (const Plan::Varying& v : plan.varying()) looks[graph.name(v.plug.node)].kept = true;

  std::string text =
      "digraph rig {\n  rankdir=LR;\n  node [shape=box, style=filled, fillcolor=white, "
      "fontname=\"sans-serif\"];\n";
  std::set<Index> drawn;
  for (NodeId id : graph.Nodes()) {
    const NodeLook& look = looks[graph.name(id)];
    if (!look.kept && !all) continue;
    drawn.insert(id.index);
    std::vector<std::string> lines = {graph.name(id), graph.def(id).name};
    std::string style;
    if (look.points_total > 0)
      lines.push_back(fmt::format("{} of {} points", Thousands(look.points), Thousands(look.points_total)));
    if (profile != nullptr && look.kept)
      lines.push_back(fmt::format("{:.1f} us", look.ns / static_cast<double>(frames) / 1e3));
    if (!look.kept) {
      style = fmt::format("style=\"filled,dashed\", fillcolor=\"#eeeeee\", fontcolor=\"#888888\", tooltip={}",
                          Quoted(look.left_out));
    } else if (profile != nullptr) {
      style = fmt::format("fillcolor={}", Quoted(HeatColor(total > 0 ? look.ns / total * 3 : 0)));
    } else {
      style = look.lazy_only && look.points_total > 0 ? "fillcolor=\"#ffe9b3\", tooltip=\"only on demand\""
                                                      : "fillcolor=\"#d8f0d8\"";
    }
    std::string label;
    for (const std::string& line : lines) label += (label.empty() ? "" : "\\n") + Escaped(line);
    text += fmt::format("  n{} [label=\"{}\", {}];\n", id.index, label, style);
  }
  // One arrow for all connections between two nodes
  std::map<std::pair<Index, Index>, std::pair<std::string, std::size_t>> arrows;
  for (NodeId id : graph.Nodes()) {
    if (!drawn.contains(id.index)) continue;
    for (const Connection& c : graph.Inputs(id)) {
      if (!drawn.contains(c.source.node.index)) continue;
      auto& [label, count] = arrows[{c.source.node.index, id.index}];
      const auto attribute = [&](const PlugRef& plug) {
        return graph.def(plug.node).attributes[static_cast<std::size_t>(plug.attribute)].name;
      };
      if (count++ == 0) label = attribute(c.source) + " > " + attribute(c.destination);
    }
  }
  for (const auto& [ends, arrow] : arrows) {
    text += fmt::format("  n{} -> n{} [tooltip={}];\n", ends.first, ends.second,
                        Quoted(arrow.second > 1 ? fmt::format("{} and {} more", arrow.first, arrow.second - 1)
                                                : arrow.first));
  }
  return text + "}\n";
}

CommandResult DrawGraph(const GraphFlags& flags) {
  const std::string place = flags.output.value_or("-");
  KPSA_RETURN_IF_ERROR(CheckAccelerationFlags(flags.acceleration, flags.acceleration.wanted()));
  KPSA_RETURN_IF_ERROR(CheckTimeFlags(flags));
  KPSA_RETURN_IF_ERROR(CheckOutput(place, flags.force, {".dot", ".gv"}));
  const Result<std::unique_ptr<OpenRig>> open = LoadRigOf(flags);
  if (!open.ok()) return open.status();
  Rig& rig = (*open)->rig;
  Compiler compiler;
  if (flags.acceleration.wanted())
    KPSA_RETURN_IF_ERROR(ApplyAcceleration(&rig, &compiler, flags.acceleration).status());
  const Result<Request> request = BuildRequest(rig, flags.wanted, flags.vertices);
  if (!request.ok()) return request.status();
  const auto plan = CompileFor(rig, &compiler, *request);
  if (!plan.ok()) return plan.status();
  const InterruptScope interruptible;
  Profile profile(**plan);
  std::size_t frames = 1;
  if (flags.time) {
    const Result<std::vector<double>> times = SampleTimes(flags, rig);
    if (!times.ok()) return times.status();
    frames = times->size();
    RigFrameOptions options;
    options.threads = 1;
    options.profile = &profile;
    KPSA_RETURN_IF_ERROR(
        EvaluateTimes(rig, *plan, *times, options, [](std::size_t, const Evaluator&) { return Status(); }));
  }
  KPSA_RETURN_IF_ERROR(
      WriteText(place, flags.force, Dot(rig, **plan, flags.time ? &profile : nullptr, frames, flags.all)));
  return 0;
}

}  // namespace

void AddGraphCommand(CLI::App* program, Command* chosen) {
  auto flags = std::make_shared<GraphFlags>();
  CLI::App* command =
      AddCommand(program, "graph", "The rig as a Graphviz drawing, coloured by what is kept or by time",
                 "Green: evaluated always; yellow: only on demand; grey (--all): left out. With --time: red "
                 "is where the time goes.\n"
                 "Examples:\n"
                 "  kpsa graph head.yaml | dot -Tsvg > head.svg\n"
                 "  kpsa graph head.yaml --time --clip face_talk -o head.dot\n"
                 "  kpsa graph head.yaml --accelerate --all -o head.dot",
                 chosen, [flags] { return DrawGraph(*flags); });
  AddRigFlags(command, flags.get());
  AddTimeFlags(command, flags.get());
  AddOutputFlags(command, flags.get(), "a .dot file instead of stdout");
  AddAccelerationFlags(command, &flags->acceleration);
  AddRepeated(command, "--want", "PLUG", &flags->wanted,
              "a plug or a mesh's points (head_mesh@mush) instead of all meshes; may be repeated");
  AddOption(command, "--vertices", "LIST", &flags->vertices,
            "only some vertices of the wanted meshes, as in 0:99,120");
  AddSwitch(command, "--time", &flags->time, "evaluate the clip and colour by time");
  AddSwitch(command, "--all", &flags->all, "draw the nodes that are left out, too");
}

}  // namespace kpsa
