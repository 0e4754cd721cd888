// kpsa compile: what a request needs of a rig, and why.
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/acceleration.h"
#include "cli/command.h"
#include "cli/common.h"
#include "cli/options.h"
#include "cli/request.h"
#include "graph/plan_report.h"
#include "host/rig_frames.h"
#include "host/rig_training.h"
#include "report/table.h"

namespace kpsa::engine {
namespace {

struct CompileFlags : Flags {
  AccelerationFlags acceleration;
  std::vector<std::string> wanted;
  std::optional<std::string> vertices;
  bool steps = false;
};

// The steps of one node in one segment, as one row.
struct Row {
  std::string name, type, segment, needed_by;
  Index points = 0, points_total = 0, steps = 0;
};

std::vector<Row> Rows(const Plan& plan, bool each_step) {
  std::vector<Row> rows;
  std::map<std::pair<std::string, Index>, std::size_t> by_name;
  for (Index s = 0; s < plan.steps().size(); ++s) {
    const Plan::StepInfo& info = plan.infos()[s];
    const std::string name = each_step ? StepName(plan, s) + fmt::format(" #{}", s) : plan.step_name(s);
    const auto [it, added] = by_name.emplace(std::make_pair(name, info.segment), rows.size());
    if (added)
      rows.push_back({each_step ? StepName(plan, s) : name, plan.step_type(s),
                      SegmentName(plan, info.segment), "", 0, 0, 0});
    Row& row = rows[it->second];
    ++row.steps;
    if (info.points > row.points || row.points_total == 0)
      row.points = info.points, row.points_total = info.points_total;
    const std::string needed = NeededBy(plan, s);
    if (row.needed_by.empty() || needed.starts_with("the request")) row.needed_by = needed;
  }
  return rows;
}

CommandResult Compile(const CompileFlags& flags) {
  KPSA_RETURN_IF_ERROR(CheckAccelerationFlags(flags.acceleration, flags.acceleration.wanted()));
  const Result<std::unique_ptr<OpenRig>> open = LoadRigOf(flags);
  if (!open.ok()) return open.status();
  Rig& rig = (*open)->rig;
  Compiler compiler;
  Result<Request> request =
      AcceleratedRequest(&rig, &compiler, flags.acceleration, flags.wanted, flags.vertices);
  if (!request.ok()) return request.status();
  request->varying = VaryingPlugs(rig);
  const auto compiled = CompileFor(rig, &compiler, *request);
  if (!compiled.ok()) return compiled.status();
  const Plan& plan = **compiled;
  const std::vector<Row> rows = Rows(plan, flags.steps);
  const std::size_t buffers = (plan.buffer_floats() + plan.workspace_floats()) * sizeof(float);
  if (flags.json) {
    nlohmann::ordered_json nodes = nlohmann::ordered_json::array(), excluded = nodes, varying = nodes,
                           outputs = nodes;
    for (const Row& row : rows) {
      nodes.push_back({{"name", row.name},
                       {"type", row.type},
                       {"segment", row.segment},
                       {"points", row.points},
                       {"points_total", row.points_total},
                       {"steps", row.steps},
                       {"needed_by", row.needed_by}});
    }
    for (const Plan::Excluded& e : plan.excluded())
      excluded.push_back({{"name", e.node_name}, {"reason", e.reason}});
    for (const Plan::Varying& v : plan.varying()) varying.push_back(v.name);
    for (const Plan::Output& o : plan.outputs())
      outputs.push_back({{"name", o.name}, {"points", o.points.size()}, {"points_total", o.points.total()}});
    PrintJson(nlohmann::ordered_json{{"schema", "kpsa.compile/1"},
                                     {"steps", plan.steps().size()},
                                     {"segments", plan.segments().size()},
                                     {"buffer_bytes", buffers},
                                     {"outputs", outputs},
                                     {"varying", varying},
                                     {"nodes", nodes},
                                     {"excluded", excluded}});
    return 0;
  }
  Table kept({"node", "type", ">points", ">of", "evaluated", "needed by"});
  for (const Row& row : rows) {
    kept.Row({row.name, row.type, row.points_total == 0 ? "" : Thousands(row.points),
              row.points_total == 0 ? "" : Thousands(row.points_total), row.segment, row.needed_by});
  }
  Print(fmt::format("Kept: {} in {}; {} of points and scratch\n\n", Plural(plan.steps().size(), "step"),
                    Plural(plan.segments().size(), "segment"), ByteText(buffers)));
  Print(kept.Text());
  std::map<std::string, std::vector<std::string>> by_reason;
  for (const Plan::Excluded& e : plan.excluded()) by_reason[e.reason].push_back(e.node_name);
  for (const auto& [reason, names] : by_reason)
    Print(fmt::format("\nLeft out, {} ({}):\n  {}\n", reason, Plural(names.size(), "node"),
                      fmt::join(names, ", ")));
  return 0;
}

}  // namespace

void AddCompileCommand(CLI::App* program, Command* chosen) {
  auto flags = std::make_shared<CompileFlags>();
  CLI::App* command =
      AddCommand(program, "compile", "Which nodes and how many points of each a request keeps, and why",
                 "Time and the rig's controls vary.\n"
                 "Examples:\n"
                 "  kpsa compile head.yaml\n"
                 "  kpsa compile head.yaml --want head_mesh@mush --vertices 0:9\n"
                 "  kpsa compile head.glb --want jaw.worldMatrix",
                 chosen, [flags] { return Compile(*flags); });
  AddRigFlags(command, flags.get());
  AddRepeated(command, "--want", "PLUG", &flags->wanted,
              "a plug or a mesh's points (head_mesh@mush) instead of all visible meshes; may be repeated");
  AddOption(command, "--vertices", "LIST", &flags->vertices,
            "only some vertices of the wanted meshes, as in 0:99,120");
  AddSwitch(command, "--steps", &flags->steps, "every step by itself instead of nodes");
  AddAccelerationFlags(command, &flags->acceleration);
  AddJsonFlag(command, flags.get());
}

}  // namespace kpsa::engine
