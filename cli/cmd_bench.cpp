// kpsa bench: full against accelerated on the same frames.
#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/bench_run.h"
#include "cli/command.h"
#include "cli/frames_range.h"
#include "cli/options.h"
#include "cli/table.h"

namespace kpsa {
namespace {

struct BenchFlags : Flags {
  AccelerationFlags acceleration;
  std::optional<std::string> runs;
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

double Finite(double value) { return std::isfinite(value) ? value : -1; }

nlohmann::ordered_json Json(const BenchResult& r, const BenchFlags& flags, const BenchOptions& options) {
  nlohmann::ordered_json nodes = nlohmann::ordered_json::array();
  for (const BenchNode& n : r.full_nodes) {
    nodes.push_back({{"name", n.name},
                     {"type", n.type},
                     {"ms_per_frame", n.ms_per_frame},
                     {"points", n.points},
                     {"ns_per_point", n.points == 0 ? 0 : n.ms_per_frame * 1e6 / n.points}});
  }
  const double frames = static_cast<double>(std::max<std::size_t>(1, r.frames));
  const std::string bound =
      fmt::format("the graph above the points ({:.4f} ms){}", r.bound_graph_ms,
                  r.bound_points_ms > 0
                      ? fmt::format(" and points that are not accelerated ({:.4f} ms)", r.bound_points_ms)
                      : "");
  return {
      {"schema", "kpsa.bench/1"},
      {"rig", flags.file},
      {"clip", fmt::format("{}", fmt::join(r.clips, ", "))},
      {"clips", r.clips},
      {"trained_on", r.trained_on},
      {"points", r.points},
      {"output_points", r.output_points},
      {"cues", r.cues},
      {"cue_stages", r.cue_stages},
      {"modes", r.modes},
      {"frames", r.frames},
      {"threads", options.threads},
      {"runs", options.runs},
      {"tolerance", r.tolerance},
      {"full",
       {{"ms_per_frame", r.full_ms},
        {"ns_per_point", r.output_points == 0 ? 0 : r.full_ms * 1e6 / static_cast<double>(r.output_points)},
        {"nodes", nodes}}},
      {"accelerated",
       {{"ms_per_frame", r.accelerated_ms},
        {"graph", r.graph_ms},
        {"cues", r.cues_ms},
        {"projection", r.projection_ms},
        {"reconstruction", r.reconstruction_ms},
        {"downstream", r.downstream_ms},
        {"misses", r.misses_ms}}},
      {"speedup", r.speedup()},
      {"speedup_on_hits",
       r.hits == 0 ? nlohmann::ordered_json() : nlohmann::ordered_json(r.speedup_on_hits())},
      {"ceiling", {{"speedup", r.ceiling()}, {"ms_per_frame", r.bound_ms}, {"bound_by", bound}}},
      {"hit_rate", static_cast<double>(r.hits) / frames},
      {"violation_rate", static_cast<double>(r.violations) / frames},
      {"violation_limit", r.violation_limit},
      {"error",
       {{"rms", Finite(r.error_rms)},
        {"max", Finite(r.error_max)},
        {"p99", Finite(r.error_p99)},
        {"bbox_diagonal", r.diagonal},
        {"worst_clip", r.worst_clip},
        {"worst_frame", r.worst_frame}}},
      {"motion", {{"rms", r.motion_rms}}},
      {"nodes", {{"total", r.nodes_total}, {"never_evaluated", r.never_evaluated}}},
      {"points_evaluated_per_frame", {{"full", r.points_full}, {"accelerated", r.points_accelerated}}},
      {"notes", r.notes}};
}

void PrintReport(const BenchResult& r, const BenchFlags& flags, const BenchOptions& options) {
  const double frames = static_cast<double>(std::max<std::size_t>(1, r.frames));
  Print(fmt::format("{}: {} by {} ({}), {} modes\n", flags.file, Plural(r.points, "point"),
                    Plural(r.cues, "cue"), fmt::join(r.cue_stages, ", "), r.modes));
  Print(fmt::format("trained on {}; tested on {}: {}, {}, medians of {}\n\n", fmt::join(r.trained_on, ", "),
                    fmt::join(r.clips, ", "), Plural(r.frames, "frame"),
                    Plural(static_cast<std::uint64_t>(options.threads), "thread"),
                    Plural(static_cast<std::uint64_t>(options.runs), "run")));
  std::string heaviest;
  for (std::size_t i = 0; i < std::min<std::size_t>(4, r.full_nodes.size()); ++i)
    heaviest +=
        fmt::format("{}{} {:.3f}", i == 0 ? "" : ", ", r.full_nodes[i].name, r.full_nodes[i].ms_per_frame);
  std::string parts = fmt::format("graph {:.3f}, cues {:.3f}, projection {:.3f}, reconstruction {:.3f}",
                                  r.graph_ms, r.cues_ms, r.projection_ms, r.reconstruction_ms);
  if (r.downstream_ms > 0) parts += fmt::format(", later stages {:.3f}", r.downstream_ms);
  if (r.misses_ms > 0) parts += fmt::format(", misses {:.3f}", r.misses_ms);
  Table times({"", ">ms/frame", "of which"});
  times.Row({"full", fmt::format("{:.3f}", r.full_ms), heaviest});
  times.Row({"accelerated", fmt::format("{:.3f}", r.accelerated_ms), parts});
  Print(times.Text());
  Print(fmt::format("\nspeedup    {:.2f}x{}; ceiling {:.1f}x, bound by the graph above the points{}\n",
                    r.speedup(), r.hits == 0 ? "" : fmt::format(", {:.2f}x on hits", r.speedup_on_hits()),
                    r.ceiling(), r.bound_points_ms > 0 ? " and points that are not accelerated" : ""));
  Print(fmt::format("hits       {:.1f} % of frames; {:.1f} % of frames beyond the tolerance of {}\n",
                    100 * static_cast<double>(r.hits) / frames,
                    100 * static_cast<double>(r.violations) / frames, LengthText(r.tolerance)));
  Print(fmt::format("error      RMS {}, 99 % {}, max {} (frame {} of {}); motion RMS {}, diagonal {}\n",
                    LengthText(r.error_rms), LengthText(r.error_p99), LengthText(r.error_max), r.worst_frame,
                    r.worst_clip, LengthText(r.motion_rms), LengthText(r.diagonal)));
  Print(fmt::format("evaluated  {} points a frame instead of {}; {} of {} nodes never{}\n",
                    Thousands(static_cast<std::uint64_t>(std::llround(r.points_accelerated))),
                    Thousands(static_cast<std::uint64_t>(std::llround(r.points_full))),
                    r.never_evaluated.size(), r.nodes_total,
                    r.never_evaluated.empty()
                        ? ""
                        : fmt::format(": {}{}",
                                      fmt::join(r.never_evaluated.begin(),
                                                r.never_evaluated.begin() +
                                                    static_cast<std::ptrdiff_t>(
                                                        std::min<std::size_t>(6, r.never_evaluated.size())),
                                                ", "),
                                      r.never_evaluated.size() > 6 ? ", ..." : "")));
  if (!r.worst_miss.empty()) Print(r.worst_miss + "\n");
  const std::string with =
      flags.acceleration.kpsa.has_value() ? "--kpsa " + *flags.acceleration.kpsa : "--accelerate";
  Print(fmt::format("\nnext: kpsa eval {} {} -o fast.npz\n", flags.file, with));
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
  if (flags.json) {
    PrintJson(Json(*result, flags, options));
  } else {
    PrintReport(*result, flags, options);
  }
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
  AddQuietFlag(command, flags.get());
  AddJsonFlag(command, flags.get());
}

}  // namespace kpsa
