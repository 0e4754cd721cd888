// kpsa compare: how far apart two vertex caches are.
#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/command.h"
#include "cli/common.h"
#include "cli/frames_range.h"
#include "cli/interrupt.h"
#include "cli/options.h"
#include "files/quantity.h"
#include "files/vertex_compare.h"
#include "report/table.h"

namespace kpsa::engine {
namespace {

struct CompareFlags : Flags {
  std::string a, b;
  std::optional<std::string> tolerance;
  bool all = false;
};

CommandResult Compare(const CompareFlags& flags) {
  double tolerance = 0;
  if (flags.tolerance.has_value()) {
    const Result<double> parsed = ParseQuantity(*flags.tolerance, Unit::kLength, FileUnits());
    if (!parsed.ok() || *parsed < 0)
      return Status::Usage("--tolerance \"{}\": expected a length of 0 or more, as in 0.2mm",
                           *flags.tolerance);
    tolerance = *parsed;
  }
  double fps = 24;
  if (flags.fps.has_value()) {
    const Result<double> parsed = ParseNumber("--fps", *flags.fps);
    if (!parsed.ok()) return parsed.status();
    if (!(*parsed > 0)) return Status::Usage("--fps {}: expected a number above 0", *flags.fps);
    fps = *parsed;
  }
  const Result<VertexFile> a = ReadVertexFile(flags.a, fps), b = ReadVertexFile(flags.b, fps);
  if (!a.ok()) return a.status();
  if (!b.ok()) return b.status();
  VertexPairs pairs;
  if (const Status match = MatchVertices(*a, *b, &pairs); !match.ok()) {
    if (flags.json)
      PrintJson(nlohmann::ordered_json{
          {"schema", "kpsa.compare/1"}, {"same", false}, {"reason", match.errors().front().message}});
    return match;
  }
  std::vector<FrameError> frames;
  std::vector<double> distances;
  double square = 0;
  std::size_t worst = 0;
  for (std::size_t f = 0; f < a->frame_count; ++f) {
    if (Interrupted()) return InterruptedStatus();
    frames.push_back(CompareFrame(pairs, f, &distances));
    square += frames.back().rms * frames.back().rms;
    if (frames.back().max > frames[worst].max) worst = f;
  }
  const double rms = frames.empty() ? 0 : std::sqrt(square / static_cast<double>(frames.size()));
  const double max = frames.empty() ? 0 : frames[worst].max;
  const bool same = max <= tolerance;
  if (flags.json) {
    nlohmann::ordered_json rows = nlohmann::ordered_json::array();
    for (const FrameError& e : frames) {
      rows.push_back({{"frame", e.frame},
                      {"time", a->times.empty() ? 0.0 : a->times[e.frame]},
                      {"max", e.max},
                      {"rms", e.rms},
                      {"p99", e.p99},
                      {"array", e.array},
                      {"vertex", e.vertex}});
    }
    nlohmann::ordered_json document = {
        {"schema", "kpsa.compare/1"}, {"same", same}, {"tolerance", tolerance}, {"max", max}, {"rms", rms}};
    if (!frames.empty()) document["worst"] = rows[worst];
    document["frames"] = std::move(rows);
    PrintJson(document);
    return same ? 0 : 1;
  }
  std::vector<FrameError> shown = frames;
  constexpr std::size_t kMostRows = 12;
  if (!flags.all && shown.size() > kMostRows) {
    std::stable_sort(shown.begin(), shown.end(),
                     [](const FrameError& x, const FrameError& y) { return x.max > y.max; });
    shown.resize(kMostRows);
  }
  Table table({">frame", ">time", ">max", ">RMS", ">p99", "worst vertex"});
  for (const FrameError& e : shown) {
    table.Row({std::to_string(e.frame), a->times.empty() ? "" : fmt::format("{:.4g} s", a->times[e.frame]),
               LengthText(e.max), LengthText(e.rms), LengthText(e.p99),
               e.array.empty() ? std::to_string(e.vertex) : fmt::format("{} {}", e.array, e.vertex)});
  }
  if (!flags.quiet) {
    Print(table.Text());
    if (shown.size() < frames.size())
      Print(fmt::format("... the worst {} of {} (--all shows all)\n", shown.size(),
                        Plural(frames.size(), "frame")));
    Print("\n");
  }
  Print(fmt::format("{}: max {}, RMS {} over {}; tolerance {}\n", same ? "same" : "differ", LengthText(max),
                    LengthText(rms), Plural(frames.size(), "frame"), LengthText(tolerance)));
  return same ? 0 : 1;
}

}  // namespace

void AddCompareCommand(CLI::App* program, Command* chosen) {
  auto flags = std::make_shared<CompareFlags>();
  CLI::App* command =
      AddCommand(program, "compare", "How far apart two vertex caches are; exit 1 beyond the tolerance",
                 "Exit 0: same within the tolerance. 1: they differ, or have other meshes, vertices or "
                 "times. 3: a file is no cache.\n"
                 "Examples:\n"
                 "  kpsa compare full.npz fast.npz --tolerance 0.2mm\n"
                 "  kpsa compare a.pc2 b.mdd --json",
                 chosen, [flags] { return Compare(*flags); });
  AddRequired(command, "A", &flags->a, "a vertex cache: .npz .pc2 .mdd");
  AddRequired(command, "B", &flags->b, "another");
  AddOption(command, "--tolerance", "LENGTH", &flags->tolerance,
            "the largest distance of two vertices that passes, as in 0.2mm; 0 if not given");
  AddOption(command, "--fps", "N", &flags->fps, "frames a second of .pc2 files; 24 if not given");
  AddSwitch(command, "--all", &flags->all, "all frames, not only the worst");
  AddQuietFlag(command, flags.get());
  AddJsonFlag(command, flags.get());
}

}  // namespace kpsa::engine
