// kpsa compare: how far apart two vertex caches are.
#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/command.h"
#include "cli/common.h"
#include "cli/frames_range.h"
#include "cli/options.h"
#include "cli/table.h"
#include "cli/vertex_file.h"
#include "io/quantity.h"

namespace kpsa {
namespace {

struct CompareFlags : Flags {
  std::string a, b;
  std::optional<std::string> tolerance;
  bool all = false;
};

struct FrameError {
  std::size_t frame = 0;
  double max = 0, rms = 0, p99 = 0;
  std::string array;  // where the worst vertex is
  std::size_t vertex = 0;
};

// Arrays that stand for each other, or what is missing.
Status Match(const VertexFile& a, const VertexFile& b,
             std::vector<std::pair<const VertexArray*, const VertexArray*>>* pairs) {
  const auto differ = [&](const std::string& message) {
    return Status::Make(ErrorKind::kDiffers, message).At({b.path});
  };
  if (a.frame_count != b.frame_count)
    return differ(fmt::format("has {}, {} has {}", Plural(b.frame_count, "frame"), a.path, a.frame_count));
  if (!a.times.empty() && !b.times.empty()) {
    for (std::size_t i = 0; i < a.times.size(); ++i) {
      // PC2 and MDD hold float32 times
      if (std::abs(a.times[i] - b.times[i]) > 1e-6 * std::max(1.0, std::abs(a.times[i]))) {
        return differ(fmt::format("frame {} is at {} s, in {} at {} s", i, b.times[i], a.path, a.times[i]));
      }
    }
  }
  const bool unnamed = (a.arrays.size() == 1 && a.arrays[0].name.empty()) ||
                       (b.arrays.size() == 1 && b.arrays[0].name.empty());
  if (a.arrays.size() != b.arrays.size())
    return differ(
        fmt::format("has {}, {} has {}", Plural(b.arrays.size(), "array"), a.path, a.arrays.size()));
  std::vector<std::string> names;
  for (const VertexArray& array : b.arrays) names.push_back(array.name);
  for (const VertexArray& array : a.arrays) {
    const auto found = unnamed ? b.arrays.begin()
                               : std::find_if(b.arrays.begin(), b.arrays.end(),
                                              [&](const VertexArray& x) { return x.name == array.name; });
    if (found == b.arrays.end())
      return differ(fmt::format("has no array \"{}\"{}", array.name, DidYouMean(array.name, names)));
    if (found->vertices != array.vertices)
      return differ(fmt::format("\"{}\" has {}, in {} it has {}", found->name,
                                Plural(found->vertices, "vertex"), a.path, array.vertices));
    pairs->emplace_back(&array, &*found);
  }
  return Status();
}

FrameError CompareFrame(const std::vector<std::pair<const VertexArray*, const VertexArray*>>& pairs,
                        std::size_t frame, std::vector<double>* distances) {
  FrameError error;
  error.frame = frame;
  distances->clear();
  double sum = 0;
  for (const auto& [a, b] : pairs) {
    const float* x = a->frames.data() + frame * a->vertices * 3;
    const float* y = b->frames.data() + frame * a->vertices * 3;
    for (std::size_t v = 0; v < a->vertices; ++v) {
      double square = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        const double d = static_cast<double>(x[3 * v + c]) - static_cast<double>(y[3 * v + c]);
        square += d * d;
      }
      // What is not a number is infinitely far from everything
      const double distance = std::isfinite(square) ? std::sqrt(square) : HUGE_VAL;
      sum += distance * distance;
      if (distance > error.max || distances->empty())
        error.max = distance, error.array = a->name, error.vertex = v;
      distances->push_back(distance);
    }
  }
  if (distances->empty()) return error;
  error.rms = std::sqrt(sum / static_cast<double>(distances->size()));
  const std::size_t rank = (distances->size() * 99 + 99) / 100 - 1;
  std::nth_element(distances->begin(), distances->begin() + static_cast<std::ptrdiff_t>(rank),
                   distances->end());
  error.p99 = (*distances)[rank];
  return error;
}

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
  std::vector<std::pair<const VertexArray*, const VertexArray*>> pairs;
  if (const Status match = Match(*a, *b, &pairs); !match.ok()) {
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

}  // namespace kpsa
