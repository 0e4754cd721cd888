// kpsa bench: full against accelerated on the same frames.
#include <algorithm>
#include <memory>

#include "cli/bench_report.h"
#include "cli/command.h"
#include "cli/frames_range.h"
#include "cli/options.h"

namespace kpsa {
namespace {

struct BenchFlags : Flags {
  AccelerationFlags acceleration;
  std::optional<std::string> runs;
  bool per_frame = false;
};

// The rig's test clips; without them, what the flags choose ("").
Result<std::vector<std::string>> TestClips(const BenchFlags& flags, std::vector<std::string>* notes) {
  if (flags.clip.has_value() || flags.rest) return std::vector<std::string>{""};
  const Result<std::unique_ptr<OpenRig>> open = LoadRigOf(flags);
  if (!open.ok()) return open.status();
  std::vector<std::string> clips;
  for (const Acceleration& entry : (*open)->rig.accelerate) {
    for (const std::string& clip : entry.test_clips) {
      if (std::find(clips.begin(), clips.end(), clip) == clips.end()) clips.push_back(clip);
    }
  }
  if (clips.empty()) {
    clips.emplace_back();
    notes->push_back(
        "the rig names no test clips (accelerate: {test: {clips: [...]}}); taking the first clip, which may "
        "be a trained one");
  }
  return clips;
}

CommandResult RunBenchCommand(const BenchFlags& flags) {
  KPSA_RETURN_IF_ERROR(CheckTimeFlags(flags));
  KPSA_RETURN_IF_ERROR(CheckAccelerationFlags(flags.acceleration, true));
  const Result<int> threads = ThreadCount(flags),
                    runs = ParseCount("--runs", flags.runs.value_or("5"), 1, 1000);
  if (!threads.ok()) return threads.status();
  if (!runs.ok()) return runs.status();
  BenchOptions options;
  options.runs = *runs;
  options.threads = *threads == 0 ? 1 : *threads;
  options.quiet = flags.quiet;
  std::vector<std::string> notes;
  const Result<std::vector<std::string>> clips = TestClips(flags, &notes);
  if (!clips.ok()) return clips.status();
  const InterruptScope interruptible;
  Result<BenchResult> result = RunBench(flags, flags.acceleration, *clips, options);
  if (!result.ok()) return result.status();
  result->notes.insert(result->notes.begin(), notes.begin(), notes.end());
  const BenchContext context{flags.file, flags.acceleration.kpsa, options};
  Print(flags.json ? BenchJson(*result, context) : BenchText(*result, context));
  if (flags.per_frame && !flags.json) Print("\n" + FramesText(*result));
  if (!flags.quiet) {
    for (const std::string& note : result->notes) Say("note: " + note);
  }
  return 0;
}

}  // namespace

void AddBenchCommand(CLI::App* program, Command* chosen) {
  auto flags = std::make_shared<BenchFlags>();
  CLI::App* command =
      AddCommand(program, "bench", "Full against accelerated on the same frames: times, errors, hits",
                 "Runs the rig's test clips with its own subspaces, unless --clip and --kpsa say otherwise. "
                 "Errors are end to end:\n"
                 "final points against the full evaluation, all frames, misses included.\n"
                 "Examples:\n"
                 "  kpsa bench head.yaml\n"
                 "  kpsa bench head.yaml --kpsa other.kpsa --clip face_talk --json\n"
                 "  kpsa bench head.yaml --tolerance 0.5mm --threads 2",
                 chosen, [flags] { return RunBenchCommand(*flags); });
  AddRigFlags(command, flags.get());
  AddTimeFlags(command, flags.get());
  AddAccelerationFlags(command, &flags->acceleration, false);
  AddOption(command, "--runs", "N", &flags->runs, "timed evaluations of every frame; 5 if not given");
  AddOption(command, "--threads", "N", &flags->threads, "threads of both sides; 1 if not given");
  AddSwitch(command, "--per-frame", &flags->per_frame, "a line a frame: hit, error, times, speedup");
  AddQuietFlag(command, flags.get());
  AddJsonFlag(command, flags.get());
}

}  // namespace kpsa
