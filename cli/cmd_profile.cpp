// kpsa profile: where the time of an evaluation goes.
#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>

#include "base/parallel.h"
#include "cli/acceleration.h"
#include "cli/command.h"
#include "cli/common.h"
#include "cli/frames_range.h"
#include "cli/options.h"
#include "cli/output.h"
#include "cli/request.h"
#include "graph/plan_report.h"
#include "host/profile_run.h"
#include "host/rig_frames.h"
#include "report/table.h"
#include "report/trace.h"

namespace kpsa::engine {
namespace {

struct ProfileFlags : Flags {
  AccelerationFlags acceleration;
  std::optional<std::string> trace, top, sort;
};

void PrintReport(const ProfileFlags& flags, const Plan& plan, const Measured& measured,
                 std::vector<NodeTime> nodes, const CriticalPath& path, std::size_t top) {
  const auto frames = static_cast<double>(measured.frames.size());
  if (flags.sort == "inclusive")
    std::stable_sort(nodes.begin(), nodes.end(),
                     [](auto& a, auto& b) { return a.inclusive_ns > b.inclusive_ns; });
  if (flags.sort == "count")
    std::stable_sort(nodes.begin(), nodes.end(), [](auto& a, auto& b) { return a.count > b.count; });
  if (flags.sort == "points")
    std::stable_sort(nodes.begin(), nodes.end(), [](auto& a, auto& b) { return a.points > b.points; });
  if (flags.sort == "name")
    std::stable_sort(nodes.begin(), nodes.end(), [](auto& a, auto& b) { return a.name < b.name; });
  Table table({"node", "type", ">self us", ">inclusive us", ">count", ">points", ">ns/point", ">share"});
  for (std::size_t i = 0; i < std::min(top, nodes.size()); ++i) {
    const NodeTime& n = nodes[i];
    const double computed_points = static_cast<double>(n.points) * static_cast<double>(n.count);
    table.Row({n.name, n.type, fmt::format("{:.1f}", n.self_ns / frames / 1e3),
               fmt::format("{:.1f}", n.inclusive_ns / frames / 1e3), Thousands(n.count),
               n.points == 0 ? "" : Thousands(n.points),
               computed_points > 0 ? fmt::format("{:.2f}", n.self_ns / computed_points) : "",
               fmt::format("{:.1f} %", 100 * n.self_ns / measured.wall_ns)});
  }
  Print(table.Text());
  if (nodes.size() > top)
    Print(fmt::format("... and {} more (--top {} shows all)\n", Plural(nodes.size() - top, "node"),
                      nodes.size()));
  Print(fmt::format("\nFrame: {:.3f} ms (mean of {}); in nodes {:.3f} ms, between them {:.3f} ms\n",
                    measured.wall_ns / frames / 1e6, Plural(measured.frames.size(), "frame"),
                    measured.node_ns / frames / 1e6, measured.between_ns() / frames / 1e6));
  std::vector<std::string> names;
  for (Index s : path.steps) names.push_back(StepName(plan, s));
  if (names.size() > 12)
    names.erase(names.begin() + 4, names.end() - 7), names.insert(names.begin() + 4, "...");
  Print(fmt::format("Critical path: {:.3f} ms: {}\n", path.ns / frames / 1e6, fmt::join(names, " > ")));
  Print(
      fmt::format("Speedup ceiling: {:.1f}x: {:.1f} % of the time is spent above the points, and a subspace "
                  "skips only what none of its cues reads\n",
                  measured.ceiling(), 100 * (measured.above_ns + measured.between_ns()) / measured.wall_ns));
}

void PrintReportJson(const Rig& rig, const Plan& plan, const Measured& measured,
                     const std::vector<NodeTime>& nodes, const CriticalPath& path, int threads) {
  const auto frames = static_cast<double>(measured.frames.size());
  nlohmann::ordered_json rows = nlohmann::ordered_json::array(), chain = rows;
  for (const NodeTime& n : nodes) {
    rows.push_back({{"name", n.name},
                    {"type", n.type},
                    {"segment", n.segment},
                    {"self_ms", n.self_ns / frames / 1e6},
                    {"inclusive_ms", n.inclusive_ns / frames / 1e6},
                    {"count", n.count},
                    {"points", n.points},
                    {"points_total", n.points_total},
                    {"share", n.self_ns / measured.wall_ns}});
  }
  for (Index s : path.steps) chain.push_back(StepName(plan, s));
  PrintJson(nlohmann::ordered_json{{"schema", "kpsa.profile/1"},
                                   {"clip", rig.scene.clip.value_or("")},
                                   {"frames", measured.frames.size()},
                                   {"threads", threads},
                                   {"ms_per_frame", measured.wall_ns / frames / 1e6},
                                   {"between_nodes_ms", measured.between_ns() / frames / 1e6},
                                   {"nodes", rows},
                                   {"critical_path", {{"ms", path.ns / frames / 1e6}, {"steps", chain}}},
                                   {"ceiling",
                                    {{"speedup", measured.ceiling()},
                                     {"above_points_ms", measured.above_ns / frames / 1e6},
                                     {"bound_by", "what is evaluated above the points"}}}});
}

CommandResult RunProfile(const ProfileFlags& flags) {
  KPSA_RETURN_IF_ERROR(CheckTimeFlags(flags));
  Result<int> threads = ThreadCount(flags);
  if (!threads.ok()) return threads.status();
  if (*threads == 0) threads = 1;
  const Result<int> top = ParseCount("--top", flags.top.value_or("20"), 1, 1'000'000);
  if (!top.ok()) return top.status();
  const std::vector<std::string> sorts = {"self", "inclusive", "count", "points", "name"};
  if (std::find(sorts.begin(), sorts.end(), flags.sort.value_or("self")) == sorts.end())
    return Status::Usage("--sort {}: expected one of {}", *flags.sort, fmt::join(sorts, ", "));
  if (flags.trace.has_value()) KPSA_RETURN_IF_ERROR(CheckOutput(*flags.trace, flags.force, {".json"}));
  if (flags.trace == "-" && flags.json)
    return Status::Usage("--trace - and --json: stdout takes one of them");
  KPSA_RETURN_IF_ERROR(CheckAccelerationFlags(flags.acceleration, flags.acceleration.wanted()));
  const Result<std::unique_ptr<OpenRig>> open = LoadRigOf(flags);
  if (!open.ok()) return open.status();
  Rig& rig = (*open)->rig;
  if (flags.trace.has_value()) KPSA_RETURN_IF_ERROR(CheckNotInput(*flags.trace, rig.files));
  const Result<std::vector<double>> times = SampleTimes(flags, **open);
  if (!times.ok()) return times.status();
  Compiler compiler;
  const Result<Request> request = AcceleratedRequest(&rig, &compiler, flags.acceleration, {}, {});
  if (!request.ok()) return request.status();
  const auto plan = CompileFor(rig, &compiler, *request);
  if (!plan.ok()) return plan.status();

  const InterruptScope interruptible;
  const ThreadLimit limit(*threads);
  Profile profile(**plan);
  profile.keep_events = flags.trace.has_value();
  const Result<Measured> measured = Measure(rig, *plan, *times, *threads > 1, InterruptWatch(), &profile);
  if (!measured.ok()) return measured.status();
  const std::vector<NodeTime> nodes = NodeTimes(**plan, profile);
  const CriticalPath path = FindCriticalPath(**plan, profile);
  if (flags.trace.has_value()) {
    KPSA_RETURN_IF_ERROR(
        WriteText(*flags.trace, flags.force, TraceJson(**plan, profile, measured->frames, *times)));
    if (profile.events().size() >= profile.max_events && !flags.quiet)
      Say(fmt::format("note: the trace holds the first {} only", Plural(profile.max_events, "event")));
  }
  if (flags.json) {
    PrintReportJson(rig, **plan, *measured, nodes, path, *threads);
  } else if (flags.trace != "-") {
    PrintReport(flags, **plan, *measured, nodes, path, static_cast<std::size_t>(*top));
  }
  return 0;
}

}  // namespace

void AddProfileCommand(CLI::App* program, Command* chosen) {
  auto flags = std::make_shared<ProfileFlags>();
  CLI::App* command =
      AddCommand(program, "profile", "Where the time goes: per node, critical path, speedup ceiling",
                 "Times are means a frame. Inclusive: a node with everything upstream of it.\n"
                 "Examples:\n"
                 "  kpsa profile head.yaml --clip face_talk\n"
                 "  kpsa profile head.yaml --frames 0:24 --trace trace.json\n"
                 "  kpsa profile head.yaml --sort inclusive --json",
                 chosen, [flags] { return RunProfile(*flags); });
  AddRigFlags(command, flags.get());
  AddTimeFlags(command, flags.get());
  AddOption(command, "--trace", "FILE.json", &flags->trace,
            "write every compute as Chrome trace JSON, for ui.perfetto.dev");
  AddSwitch(command, "--force", &flags->force, "replace an existing trace");
  AddOption(command, "--sort", "COLUMN", &flags->sort,
            "self (the default), inclusive, count, points or name");
  AddOption(command, "--top", "N", &flags->top, "rows of the table; 20 if not given");
  AddOption(command, "--threads", "N", &flags->threads,
            "threads; 1 if not given, so that times of nodes add up");
  AddAccelerationFlags(command, &flags->acceleration);
  AddQuietFlag(command, flags.get());
  AddJsonFlag(command, flags.get());
}

}  // namespace kpsa::engine
