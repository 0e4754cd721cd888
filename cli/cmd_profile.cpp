// kpsa profile: where the time of an evaluation goes.
#include <algorithm>
#include <memory>

#include "base/parallel.h"
#include "cli/acceleration.h"
#include "cli/command.h"
#include "cli/common.h"
#include "cli/frames_range.h"
#include "cli/interrupt.h"
#include "cli/options.h"
#include "cli/output.h"
#include "cli/request.h"
#include "graph/plan_report.h"
#include "host/profile_run.h"
#include "host/rig_frames.h"
#include "report/profile_text.h"
#include "report/trace.h"

namespace kpsa::engine {
namespace {

struct ProfileFlags : Flags {
  AccelerationFlags acceleration;
  std::optional<std::string> trace, top, sort;
};

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
    Print(ProfileJson(rig, **plan, *measured, nodes, path, *threads));
  } else if (flags.trace != "-") {
    Print(ProfileText(**plan, *measured, nodes, path, flags.sort.value_or("self"),
                      static_cast<std::size_t>(*top)));
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
