// kpsa bench: full against accelerated on the same frames.
#include <algorithm>
#include <map>
#include <memory>

#include "cli/acceleration.h"
#include "cli/command.h"
#include "cli/frames_range.h"
#include "cli/interrupt.h"
#include "cli/options.h"
#include "cli/progress.h"
#include "host/bench/bench.h"
#include "host/rig_training.h"
#include "report/bench_report.h"
#include "report/promise_text.h"

namespace kpsa::engine {
namespace {

struct BenchFlags : Flags {
  AccelerationFlags acceleration;             // what all sides share
  std::vector<std::string> kpsa, tolerances;  // of each; one tolerance is for all
  std::optional<std::string> runs, speedup, reference, rival;
  bool per_frame = false, check = false, idle = false;
};

// The rig's test clips; without them, what the flags choose ("").
Result<std::vector<std::string>> ClipsOf(const BenchFlags& flags, std::vector<std::string>* notes) {
  if (flags.clip.has_value() || flags.rest) return std::vector<std::string>{""};
  const Result<std::unique_ptr<OpenRig>> open = LoadRigOf(flags);
  if (!open.ok()) return open.status();
  std::vector<std::string> clips = TestClips((*open)->rig);
  if (clips.empty()) {
    clips.emplace_back();
    notes->push_back(
        "the rig names no test clips (accelerate: {test: {clips: [...]}}); taking the first clip, which may "
        "be a trained one");
  }
  return clips;
}

// One side a subspace, or one with the rig's own.
Result<std::vector<AccelerationFlags>> SidesOf(const BenchFlags& flags) {
  const std::size_t count = std::max<std::size_t>(1, flags.kpsa.size()), given = flags.tolerances.size();
  if (given > 1 && given != count)
    return Status::Usage("{} --tolerance for {} --kpsa: expected one, or one for each", given, count);
  std::vector<AccelerationFlags> sides(count, flags.acceleration);
  for (std::size_t i = 0; i < count; ++i) {
    if (!flags.kpsa.empty()) sides[i].kpsa = flags.kpsa[i];
    const std::string tolerance = given == 0 ? "own" : flags.tolerances[given == 1 ? 0 : i];
    if (tolerance != "own") sides[i].tolerance = tolerance;
    KPSA_RETURN_IF_ERROR(CheckAccelerationFlags(sides[i], true));
  }
  return sides;
}

// What the tolerance of each side leaves to do nothing; the same for sides of the same tolerance.
Status AddIdle(const BenchFlags& flags, const std::vector<std::string>& clips,
               std::vector<BenchResult>* results) {
  for (std::size_t i = 0; i < results->size(); ++i) {
    BenchResult& result = (*results)[i];
    const double tolerance = result.promise.tolerance;
    if (result.light || !result.promise.promised()) continue;
    const auto same = std::find_if(
        results->begin(), results->begin() + static_cast<std::ptrdiff_t>(i),
        [&](const BenchResult& other) { return other.idle.measured() && other.idle.tolerance == tolerance; });
    if (same != results->begin() + static_cast<std::ptrdiff_t>(i)) {
      result.idle = same->idle;
      continue;
    }
    std::map<std::string, double> full_ms;
    for (const BenchNode& node : result.full_nodes) full_ms[node.name] = node.ms_per_frame;
    Result<IdleDeformers> idle = MeasureIdle(OpenerOf(flags), clips, tolerance, full_ms, InterruptWatch());
    if (!idle.ok()) return idle.status();
    result.idle = std::move(*idle);
    if (!result.idle.measured())
      result.notes.push_back("--idle: no deformer of this stack can be switched off by an envelope");
  }
  return Status();
}

CommandResult RunBenchCommand(const BenchFlags& flags) {
  KPSA_RETURN_IF_ERROR(CheckTimeFlags(flags));
  const Result<std::vector<AccelerationFlags>> sides = SidesOf(flags);
  if (!sides.ok()) return sides.status();
  const Result<int> threads = ThreadCount(flags),
                    runs = ParseCount("--runs", flags.runs.value_or("5"), 1, 1000);
  if (!threads.ok()) return threads.status();
  if (!runs.ok()) return runs.status();
  BenchOptions options;
  options.runs = *runs;
  options.threads = *threads == 0 ? 1 : *threads;
  options.reference = flags.reference, options.rival = flags.rival;
  if (flags.rival.has_value() && !flags.reference.has_value())
    return Status::Usage("--rival {}: expected --reference, too, which says what is right", *flags.rival);
  if (flags.speedup.has_value()) {
    const Result<double> speedup = ParseSpeedup(*flags.speedup);
    if (!speedup.ok()) return speedup.status();
    options.speedup = *speedup;
  }
  std::vector<std::string> notes;
  const Result<std::vector<std::string>> clips = ClipsOf(flags, &notes);
  if (!clips.ok()) return clips.status();
  const InterruptScope interruptible;
  std::vector<AccelerationChoice> choices;
  for (const AccelerationFlags& side : *sides) {
    choices.push_back(ChoiceOf(side));
    choices.back().with_modes = true;  // for SplitFrames
  }
  Progress progress("bench, frames", 0, flags.quiet);
  Result<std::vector<BenchResult>> results =
      RunBench(OpenerOf(flags), choices, *clips, options, progress.watch());
  progress.Clear();
  if (!results.ok()) return results.status();
  if (flags.idle) KPSA_RETURN_IF_ERROR(AddIdle(flags, *clips, &*results));
  results->front().notes.insert(results->front().notes.begin(), notes.begin(), notes.end());
  const BenchContext context{flags.file, flags.kpsa, options, !flags.sets.empty() || flags.pose.has_value()};
  Print(flags.json ? BenchJson(*results, context) : BenchText(*results, context));
  if (flags.per_frame && !flags.json) Print("\n" + FramesText(*results));
  for (const BenchResult& result : *results) {
    for (const std::string& note : result.notes) {
      if (!flags.quiet) Say("note: " + note);
    }
  }
  if (!flags.check) return 0;
  int code = 0;
  for (const BenchResult& result : *results) {
    if (result.promise.kept()) continue;
    const std::string text = PromiseText(result.promise, "");
    Say(fmt::format("kpsa bench --check: {}: {}", result.subspace, text.substr(0, text.find('\n'))));
    code = 1;
  }
  return code;
}

}  // namespace

void AddBenchCommand(CLI::App* program, Command* chosen) {
  auto flags = std::make_shared<BenchFlags>();
  CLI::App* command = AddCommand(
      program, "bench", "Full against accelerated on the same frames: times, errors, hits",
      "Runs the rig's test clips with its own subspaces, unless --clip and --kpsa say otherwise. "
      "Errors are end to end:\n"
      "final points against the full evaluation, all frames, misses included. Several --kpsa take "
      "turns in one run.\n"
      "Times of one thread are those of its work, whatever else the machine does; of several they are "
      "wall times.\n"
      "Examples:\n"
      "  kpsa bench head.yaml\n"
      "  kpsa bench head.yaml --kpsa other.kpsa --clip face_talk --json\n"
      "  kpsa bench head.yaml --tolerance 0.5mm --threads 2\n"
      "  kpsa bench head.yaml --check --runs 1 -q\n"
      "  kpsa bench head.yaml --kpsa paper.kpsa --tolerance any --kpsa head.kpsa --tolerance own",
      chosen, [flags] { return RunBenchCommand(*flags); });
  AddRigFlags(command, flags.get());
  AddTimeFlags(command, flags.get());
  AddRepeated(command, "--kpsa", "FILE.kpsa", &flags->kpsa, "with this subspace; may be given several times");
  AddRepeated(
      command, "--tolerance", "LENGTH", &flags->tolerances,
      "the largest error of a point, as in 0.2mm; own: the subspace's, any: accept every frame; one, or "
      "one for each --kpsa");
  AddSharedAccelerationFlags(command, &flags->acceleration);
  AddOption(command, "--speedup", "FACTOR", &flags->speedup,
            "tell the smallest tolerance that is expected to reach it on these frames, misses included");
  AddOption(
      command, "--reference", "VARIANT", &flags->reference,
      "a variant of the rig that says what is right (light by more paths): how far both sides are from it");
  AddOption(command, "--rival", "VARIANT", &flags->rival,
            "a cheaper variant of the rig, fully evaluated: its time, and how far it is from --reference");
  AddOption(command, "--runs", "N", &flags->runs, "timed evaluations of every frame; 5 if not given");
  AddOption(command, "--threads", "N", &flags->threads, "threads of both sides; 1 if not given");
  AddSwitch(command, "--per-frame", &flags->per_frame,
            "a line a frame: hit, blend or miss and why, error, times");
  AddSwitch(
      command, "--idle", &flags->idle,
      "tell which deformers make less than the tolerance on these frames, and how much of the full cost");
  AddSwitch(command, "--check", &flags->check,
            "exit status 1 where more frames are beyond the tolerance than the calibration promises");
  AddQuietFlag(command, flags.get());
  AddJsonFlag(command, flags.get());
}

}  // namespace kpsa::engine
