// What a unit costs as rigs grow: processor time a node, a joint, a vertex of a curve, a point, a frame, a pose, of
// rigs of several sizes; and what loading a subspace costs beside full frames.
//   bench_growth [--only TEXT]... [--most N] [--subspace RIG]...
// --only: rows with that text. --most: largest size of a row, 100,000 if not given (nodes, joints and vertices of curves
// go as far as files of rigs may). --subspace: no rows, but what loading the subspaces of this trained rig costs.
// Commands run as programs of their own; of each the same command on a rig of next to nothing is taken away. Exit code
// 1 if a row is beyond its bound, 2 usage, 3 a rig that cannot be tried.
#include <fmt/format.h>
#include <stdlib.h>
#include <time.h>

#include <algorithm>
#include <filesystem>
#include <functional>

#include "bench/growth_rig.h"
#include "bench/program.h"
#include "cli/common.h"
#include "cli/frames_range.h"
#include "cli/interrupt.h"
#include "host/acceleration.h"
#include "host/rig_frames.h"
#include "host/rig_training.h"
#include "report/table.h"

namespace kpsa::engine::growth {
namespace {

constexpr double kBound = 1.5;        // the largest cost a unit over the smallest
constexpr double kMostFrames = 20;    // full ones, that loading a subspace may cost
constexpr std::size_t kLeast = 1000;  // the smallest size of a row
constexpr int kRuns = 3;              // of which the least counts

double CpuSeconds() {
  timespec t = {};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

struct Options {
  std::vector<std::string> only, subspaces;
  std::size_t most = 100'000;
};

// A rig that is read, and evaluated, in this process.
struct Costs {
  double read = 0, compile = 0, frame = 0;  // seconds
};
Result<Costs> MeasureRig(const std::string& path) {
  Costs least{1e9, 1e9, 1e9};
  for (int run = 0; run < kRuns; ++run) {
    Flags flags;
    flags.file = path;
    double start = CpuSeconds();
    const Result<std::unique_ptr<OpenRig>> open = LoadRigOf(flags);
    if (!open.ok()) return open.status();
    least.read = std::min(least.read, CpuSeconds() - start);
    const Rig& rig = (*open)->rig;
    start = CpuSeconds();
    Compiler compiler;
    Request request = ShownPoints(rig);
    request.varying = VaryingPlugs(rig);
    const Result<std::shared_ptr<const Plan>> plan = CompileFor(rig, &compiler, request);
    if (!plan.ok()) return plan.status();
    least.compile = std::min(least.compile, CpuSeconds() - start);
    Evaluator evaluator(*plan);
    KPSA_RETURN_IF_ERROR(evaluator.Evaluate());
    for (int frame = 0; frame < 2 * kRuns; ++frame) {
      evaluator.Invalidate();
      start = CpuSeconds();
      KPSA_RETURN_IF_ERROR(evaluator.Evaluate());
      least.frame = std::min(least.frame, CpuSeconds() - start);
    }
  }
  return least;
}

// One line of the table: what a unit costs at several sizes.
struct Row {
  std::string what, unit;
  std::vector<std::size_t> sizes;
  std::vector<double> ns;  // a unit
  // The most that a unit costs at a larger size, over what it costs at a smaller one.
  double Growth() const {
    double growth = 0;
    for (std::size_t i = 0; i < ns.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) growth = std::max(growth, ns[i] / std::max(ns[j], 1e-3));
    }
    return growth;
  }
};

class Bench {
 public:
  Bench(const Options& options, std::string folder) : options_(options), folder_(std::move(folder)) {}

  Status Run() {
    KPSA_RETURN_IF_ERROR(Grow(
        "node", 20'000, [](std::size_t n) { return RigSize{.nodes = n}; }, "n5"));
    KPSA_RETURN_IF_ERROR(Grow(
        "joint", 8'000, [](std::size_t n) { return RigSize{.points = 8'000, .joints = n}; }, "j5"));
    KPSA_RETURN_IF_ERROR(Grow(
        "vertex of a curve", 64'000, [](std::size_t n) { return RigSize{.vertices = n}; }, "line"));
    KPSA_RETURN_IF_ERROR(Grow(
        "point", options_.most, [](std::size_t n) { return RigSize{.points = n, .mush = true}; }, "mush"));
    KPSA_RETURN_IF_ERROR(Frames("frame, .glb", "a.glb"));
    KPSA_RETURN_IF_ERROR(Frames("frame, .pc2", "a.pc2"));
    KPSA_RETURN_IF_ERROR(Frames("frame, .npz", "a.npz"));
    return Poses();
  }

  int Print() const {
    Table table({"what", ">1,000", ">10,000", ">100,000", ">1,000,000", ">growth", ""});
    bool fine = true;
    for (const Row& row : rows_) {
      std::vector<std::string> cells{row.what + ", a " + row.unit};
      for (const std::size_t column : {1'000, 10'000, 100'000, 1'000'000}) {
        std::string cell;
        for (std::size_t i = 0; i < row.sizes.size(); ++i) {
          if (row.sizes[i] <= column / 4 || row.sizes[i] > 4 * column) continue;
          cell = fmt::format("{:.3g} us{}", 1e-3 * row.ns[i],
                             row.sizes[i] == column ? "" : fmt::format(" ({})", Thousands(row.sizes[i])));
        }
        cells.push_back(cell);
      }
      cells.push_back(fmt::format("{:.2f}", row.Growth()));
      cells.push_back(row.Growth() > kBound ? fmt::format("BEYOND {:g}", kBound) : "");
      fine = fine && row.Growth() <= kBound;
      table.Row(std::move(cells));
    }
    kpsa::engine::Print(table.Text());
    return fine ? 0 : 1;
  }

 private:
  bool Wants(const std::string& what) const {
    return options_.only.empty() || std::ranges::any_of(options_.only, [&](const auto& text) {
             return what.find(text) != std::string::npos;
           });
  }
  std::vector<std::size_t> SizesTo(std::size_t most) const {
    std::vector<std::size_t> sizes;
    for (std::size_t n = kLeast; n < std::min(most, options_.most); n *= 10) sizes.push_back(n);
    if (sizes.empty() || sizes.back() * 2 <= std::min(most, options_.most))
      sizes.push_back(std::min(most, options_.most));
    return sizes;
  }
  // Seconds of a command, the least of some.
  Result<double> Seconds(const std::vector<std::string>& arguments, int runs = kRuns) const {
    double least = 1e9;
    std::vector<std::string> command{KPSA_PROGRAM};
    command.insert(command.end(), arguments.begin(), arguments.end());
    for (int run = 0; run < runs; ++run) {
      const Result<ProgramCost> cost = RunProgram(command, "/dev/null");
      if (!cost.ok()) return cost.status();
      least = std::min(least, cost->cpu);
    }
    return least;
  }

  // Rigs of more and more of a unit.
  Status Grow(const std::string& unit, std::size_t most, const std::function<RigSize(std::size_t)>& size,
              const std::string& node) {
    const std::string rig = folder_ + "/rig.yaml", vertex = "sheet[7]";
    const std::vector<std::pair<std::string, std::vector<std::string>>> commands = {
        {"kpsa compile", {"compile", rig}},
        {"kpsa profile, 5 frames", {"profile", rig, "--frames", "0:4", "-q"}},
        {"kpsa explain a node", {"explain", rig, node, "--frames", "0:1"}},
        {"kpsa explain a vertex", {"explain", rig, vertex, "--frame", "1"}}};
    std::vector<Row> rows{
        {"read and build", unit, {}, {}}, {"compile", unit, {}, {}}, {"evaluate", unit, {}, {}}};
    for (const auto& [what, arguments] : commands) rows.push_back({what, unit, {}, {}});
    if (std::ranges::none_of(rows, [&](const Row& row) { return Wants(row.what + ", a " + row.unit); }))
      return Status();
    std::vector<double> least(rows.size());  // of a rig of next to nothing
    std::vector<std::size_t> sizes{8};
    for (const std::size_t n : SizesTo(most)) sizes.push_back(n);
    for (const std::size_t n : sizes) {
      Say(fmt::format("{} of a {} ...", Thousands(n), unit));
      RigSize of = size(n);
      KPSA_RETURN_IF_ERROR(WriteRig(of, folder_).status());
      const Result<Costs> costs = MeasureRig(rig);
      if (!costs.ok()) return costs.status();
      std::vector<double> seconds{costs->read, costs->compile, costs->frame};
      for (const auto& [what, arguments] : commands) {
        const Result<double> of_command = Seconds(arguments);
        if (!of_command.ok()) return of_command.status();
        seconds.push_back(*of_command);
      }
      for (std::size_t r = 0; r < rows.size(); ++r) {
        if (n == sizes.front()) {
          least[r] = seconds[r];
          continue;
        }
        rows[r].sizes.push_back(n);
        rows[r].ns.push_back(1e9 * (seconds[r] - least[r]) / static_cast<double>(n - sizes.front()));
      }
      if (Interrupted()) return InterruptedStatus();
    }
    for (Row& row : rows) {
      if (Wants(row.what + ", a " + row.unit)) rows_.push_back(std::move(row));
    }
    return Status();
  }

  // Frames of a small rig into a file.
  Status Frames(const std::string& what, const std::string& file) {
    if (!Wants("kpsa eval, a " + what)) return Status();
    const std::string path = folder_ + "/" + file;
    const Result<std::string> rig = WriteRig({.points = 400}, folder_);
    if (!rig.ok()) return rig.status();
    Row row{"kpsa eval", what, {}, {}};
    double least = 0;
    for (const std::size_t n :
         {std::size_t{2}, std::size_t{1'000}, std::size_t{10'000}, std::size_t{100'000}}) {
      if (n > options_.most) break;
      Say(fmt::format("{} frames into {} ...", Thousands(n), file));
      const Result<double> seconds =
          Seconds({"eval", *rig, "--frames", fmt::format("0:{}", n - 1), "-o", path, "--force", "-q"},
                  n > 10'000 ? 1 : kRuns);
      if (!seconds.ok()) return seconds.status();
      if (n == 2) {
        least = *seconds;
        continue;
      }
      row.sizes.push_back(n);
      row.ns.push_back(1e9 * (*seconds - least) / static_cast<double>(n - 2));
    }
    std::filesystem::remove(path);
    rows_.push_back(std::move(row));
    return Status();
  }

  // Poses and points of a training.
  Status Poses() {
    for (const bool of_points : {false, true}) {
      Row row{"kpsa train", of_points ? "point (500 poses)" : "pose (1,000 points)", {}, {}};
      if (!Wants(row.what + ", a " + row.unit)) continue;
      for (const std::size_t n : SizesTo(of_points ? 30'000 : 8'000)) {
        Say(fmt::format("training, {} {} ...", Thousands(n), of_points ? "points" : "poses"));
        const Result<std::string> rig = WriteRig({.points = of_points ? n : 1'000,
                                                  .shapes = 8,
                                                  .mush = true,
                                                  .train = fmt::format("samples: {}", of_points ? 500 : n)},
                                                 folder_);
        if (!rig.ok()) return rig.status();
        const Result<double> seconds =
            Seconds({"train", *rig, "-o", folder_ + "/rig.kpsa", "--force", "-q"}, 1);
        if (!seconds.ok()) return seconds.status();
        row.sizes.push_back(n);
        row.ns.push_back(1e9 * *seconds / static_cast<double>(n));
      }
      rows_.push_back(std::move(row));
    }
    return Status();
  }

  const Options& options_;
  std::string folder_;
  std::vector<Row> rows_;
};

// Reads and puts in place what the rig names, beside its full frames, which are compiled already or not. False: beyond
// the bound.
Result<bool> MeasureLoading(const std::string& path) {
  const Result<Costs> full = MeasureRig(path);
  if (!full.ok()) return full.status();
  double loading[2] = {1e9, 1e9}, compile = 1e9;
  for (int run = 0; run < 16 * kRuns; ++run) {
    Flags flags;
    flags.file = path;
    const Result<std::unique_ptr<OpenRig>> open = LoadRigOf(flags);
    if (!open.ok()) return open.status();
    Rig& rig = (*open)->rig;
    Compiler compiler;
    const bool is_compiled = run % 2 == 0;
    if (is_compiled) KPSA_RETURN_IF_ERROR(CompileFor(rig, &compiler, ShownPoints(rig)).status());
    double start = CpuSeconds();
    const Result<std::vector<AppliedSubspace>> applied = ApplyAcceleration(&rig, &compiler, {});
    if (!applied.ok()) return applied.status();
    double& least = loading[is_compiled ? 0 : 1];
    least = std::min(least, CpuSeconds() - start);
    if (!is_compiled) continue;
    start = CpuSeconds();
    const Result<std::shared_ptr<const Plan>> plan = CompileFor(rig, &compiler, ShownPoints(rig));
    if (!plan.ok()) return plan.status();
    compile = std::min(compile, CpuSeconds() - start);
  }
  const double frames = loading[0] / full->frame;
  Print(
      fmt::format("{}: loading its subspaces {:.2f} ms, {:.0f} full frames of {:.3f} ms{}; {:.2f} ms where "
                  "the full side is "
                  "not compiled; compiling the accelerated side {:.1f} ms, the full one {:.1f}\n",
                  path, 1e3 * loading[0], frames, 1e3 * full->frame,
                  frames > kMostFrames ? fmt::format(" (BEYOND {:g})", kMostFrames) : "", 1e3 * loading[1],
                  1e3 * compile, 1e3 * full->compile));
  return frames <= kMostFrames;
}

Result<Options> ReadOptions(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; ++i) {
    const std::string name = argv[i];
    if (name != "--only" && name != "--most" && name != "--subspace")
      return Status::Usage("{}: expected --only TEXT, --most N or --subspace RIG", name);
    if (++i == argc) return Status::Usage("{}: expected a value", name);
    if (name == "--only") options.only.push_back(argv[i]);
    if (name == "--subspace") options.subspaces.push_back(argv[i]);
    if (name != "--most") continue;
    const Result<int> most = ParseCount(name, argv[i], static_cast<int>(kLeast), 1'000'000);
    if (!most.ok()) return most.status();
    options.most = static_cast<std::size_t>(*most);
  }
  return options;
}

int Fail(const Status& status) {
  PrintErrors("bench_growth", status);
  return ExitCode(status);
}

int Main(int argc, char** argv) {
  InstallSignalHandlers();
  const Result<Options> options = ReadOptions(argc, argv);
  if (!options.ok()) return Fail(options.status());
  const InterruptScope scope;
  int code = 0;
  for (const std::string& rig : options->subspaces) {
    const Result<bool> kept = MeasureLoading(rig);
    if (!kept.ok()) return Fail(kept.status());
    if (!*kept) code = 1;
  }
  if (!options->subspaces.empty()) {
    const Status flushed = FlushOutput();
    return flushed.ok() ? code : ExitCode(flushed);
  }
  std::error_code error;
  std::string folder = (std::filesystem::temp_directory_path(error) / "kpsa_growth_XXXXXX").string();
  if (error || ::mkdtemp(folder.data()) == nullptr)
    return Fail(Status::Invalid("cannot be made").At({folder}));
  Bench bench(*options, folder);
  const Status status = bench.Run();
  std::filesystem::remove_all(folder, error);
  if (!status.ok()) return Fail(status);
  const int grown = bench.Print();
  const Status flushed = FlushOutput();
  return flushed.ok() ? grown : ExitCode(flushed);
}

}  // namespace
}  // namespace kpsa::engine::growth

int main(int argc, char** argv) { return kpsa::engine::growth::Main(argc, argv); }
