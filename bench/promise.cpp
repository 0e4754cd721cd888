// Whether acceleration keeps its promise: no more than the violation rate of all poses is accepted with a
// point farther than the tolerance. Trains the bundled rigs, and starter rigs of the characters of a folder,
// at several tolerances with several seeds; tries fresh poses of four kinds (promise_poses.h), each evaluated
// fully and accelerated; and walks controls out of their ranges, where points must not jump.
//   bench_promise [--assets FOLDER] [--scenes FOLDER] [--rig NAME]... [--scale X]... [--seeds N] [--poses N]
//                 [--quick] [--markdown]
// Tables to stdout at the end, or at an interrupt of what there is; progress to stderr. Exit code 1 if the
// promise is broken for poses that it is about: the trainer's and mixtures of controls in their ranges; 2
// usage, 3 a rig that cannot be tried.
#include <fmt/format.h>
#include <stdlib.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>

#include "bench/promise_table.h"
#include "cli/frames_range.h"
#include "cli/interrupt.h"
#include "rig/build/writer.h"

namespace kpsa::engine {
namespace {

namespace fs = std::filesystem;

constexpr const char* kScenes[] = {"hello", "face", "boy", "animal", "car"};
constexpr const char* kCharacters[] = {"head", "human", "Fox", "robot"};
constexpr std::size_t kWalks = 12, kWalkSteps = 400;

struct Options {
  std::string assets, scenes = "scenes";
  std::vector<std::string> rigs;  // none: all
  std::vector<double> scales;
  std::size_t seeds = 2, poses = 600, walks = kWalks;
  bool markdown = false;
};

bool IsAmong(const std::string& name, std::span<const char* const> names) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

Result<Options> ReadOptions(int argc, char** argv) {
  Options options;
  std::optional<std::size_t> seeds, poses;
  bool quick = false;
  for (int i = 1; i < argc; ++i) {
    const std::string name = argv[i];
    if (name == "--quick" || name == "--markdown") {
      (name == "--quick" ? quick : options.markdown) = true;
      continue;
    }
    if (name != "--assets" && name != "--scenes" && name != "--rig" && name != "--scale" &&
        name != "--seeds" && name != "--poses")
      return Status::Usage(
          "{}: expected --assets FOLDER, --scenes FOLDER, --rig NAME, --scale X, --seeds N, --poses N, "
          "--quick or --markdown",
          name);
    if (++i == argc) return Status::Usage("{}: expected a value", name);
    const std::string value = argv[i];
    if (name == "--assets") options.assets = value;
    if (name == "--scenes") options.scenes = value;
    if (name == "--rig") {
      if (!IsAmong(value, kScenes) && !IsAmong(value, kCharacters))
        return Status::Usage("--rig {}: expected {} or {}", value, fmt::join(kScenes, ", "),
                             fmt::join(kCharacters, ", "));
      options.rigs.push_back(value);
    }
    if (name == "--scale") {
      const Result<double> scale = ParseNumber(name, value);
      if (!scale.ok()) return scale.status();
      if (!(*scale > 0)) return Status::Usage("--scale {}: expected a number above 0", value);
      options.scales.push_back(*scale);
    }
    if (name == "--seeds" || name == "--poses") {
      const Result<int> count = ParseCount(name, value, 1, 1'000'000);
      if (!count.ok()) return count.status();
      (name == "--seeds" ? seeds : poses) = static_cast<std::size_t>(*count);
    }
  }
  if (quick) options.seeds = 1, options.poses = 200, options.walks = 4;
  options.seeds = seeds.value_or(options.seeds);
  options.poses = poses.value_or(options.poses);
  if (options.scales.empty()) options.scales = quick ? std::vector{1.0} : std::vector{0.2, 1.0, 5.0};
  for (const std::string& rig : options.rigs) {
    if (IsAmong(rig, kCharacters) && options.assets.empty())
      return Status::Usage("--rig {}: expected its folder with --assets", rig);
  }
  return options;
}

// A folder for the starter rigs, removed with them.
class ScratchFolder {
 public:
  ScratchFolder() {
    std::error_code error;
    std::string name = (fs::temp_directory_path(error) / "kpsa_promise_XXXXXX").string();
    if (!error && ::mkdtemp(name.data()) != nullptr) path_ = name;
  }
  ~ScratchFolder() {
    std::error_code error;
    if (!path_.empty()) fs::remove_all(path_, error);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

// What `kpsa init` writes, as a file in the folder.
Result<std::string> WriteStarterRig(const std::string& character, const std::string& name,
                                    const fs::path& folder) {
  if (folder.empty()) return Status::Invalid("no temporary folder for the rig").At({character});
  NodeRegistry registry;
  AddAllNodes(registry);
  StarterOptions options;
  options.character = fs::path(character).filename().string();
  std::error_code error;
  fs::copy_file(character, folder / options.character, error);
  if (error) return Status::Invalid("cannot be copied: {}", error.message()).At({character});
  options.subspace = name + ".kpsa";
  const Result<std::string> text = StarterRig(registry, character, options);
  if (!text.ok()) return text.status();
  const std::string path = (folder / (name + ".yaml")).string();
  std::ofstream file(path, std::ios::binary);
  file << *text;
  if (!file.flush()) return Status::Invalid("cannot be written").At({path});
  return path;
}

class Stopwatch {
 public:
  // Seconds since the last call.
  double Lap() {
    const auto now = std::chrono::steady_clock::now();
    const double seconds = std::chrono::duration<double>(now - begin_).count();
    begin_ = now;
    return seconds;
  }

 private:
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

struct Seconds {
  double training = 0, poses = 0, walks = 0;
};

class Bench {
 public:
  explicit Bench(const Options& options) : options_(options) {}

  // Rows in the order of tolerances, then seeds; where it fails, those of the seeds before.
  Status TryRig(const std::string& name, const std::string& path) {
    Result<std::unique_ptr<PromiseRig>> rig = PromiseRig::Open(path);
    if (!rig.ok()) return rig.status();
    const auto first_row = static_cast<std::ptrdiff_t>(rows_.size());
    const auto first_walk = static_cast<std::ptrdiff_t>(walks_.size());
    Status status;
    for (std::uint64_t seed = 1; seed <= options_.seeds && status.ok(); ++seed)
      status = TrySeed(rig->get(), name, seed);
    const auto order = [&](const auto& a, const auto& b) {
      const auto rank = [&](double scale) {
        return std::find(options_.scales.begin(), options_.scales.end(), scale) - options_.scales.begin();
      };
      return rank(a.of.scale) < rank(b.of.scale);
    };
    std::stable_sort(rows_.begin() + first_row, rows_.end(), order);
    std::stable_sort(walks_.begin() + first_walk, walks_.end(), order);
    return status;
  }

  int Report() const {
    Print(options_.markdown ? PromiseMarkdown(rows_, walks_) : PromiseText(rows_, walks_));
    Say(fmt::format("training {:.0f} s, poses {:.0f} s, walks {:.0f} s", total_.training, total_.poses,
                    total_.walks));
    const bool broken = std::any_of(rows_.begin(), rows_.end(), [](const PromiseRow& row) {
      return (row.kind == TrialKind::kSampler || row.kind == TrialKind::kMixtures) && row.broken();
    });
    return broken ? 1 : 0;
  }

 private:
  Status TrySeed(PromiseRig* rig, const std::string& name, std::uint64_t seed) {
    std::vector<PromiseCase> cases;
    std::vector<PromiseTraining> trainings;
    Stopwatch watch;
    for (const double scale : options_.scales) {
      PromiseCase& of = cases.emplace_back(PromiseCase{name, scale, scale * rig->tolerance(), seed, 0});
      Result<PromiseTraining> training = rig->Train(of.tolerance, seed);
      if (!training.ok()) return training.status();
      of.promised = training->subspace().violation_rate;
      trainings.push_back(std::move(*training));
      const double seconds = watch.Lap();
      total_.training += seconds;
      Say(fmt::format("{} at {:g} tolerances, seed {}: trained in {:.1f} s", name, scale, seed, seconds));
    }
    std::size_t poses_tried = 0, broken = 0;
    for (const TrialKind kind : kTrialKinds) {
      if (Interrupted()) return Status::Make(ErrorKind::kInterrupted, "interrupted");
      const Result<std::vector<PromisePose>> poses = DrawPoses(rig, kind, options_.poses, seed);
      if (!poses.ok()) return poses.status();
      if (poses->empty()) continue;
      const Result<std::vector<std::vector<PromiseOutcome>>> outcomes = rig->Try(*poses, trainings);
      if (!outcomes.ok()) return outcomes.status();
      for (std::size_t t = 0; t < cases.size(); ++t) {
        rows_.push_back(CountOutcomes(cases[t], kind, (*outcomes)[t]));
        broken += rows_.back().broken();
      }
      poses_tried += poses->size();
    }
    const double pose_seconds = watch.Lap();
    const Result<std::vector<PromiseWalk>> walks = DrawWalks(rig, options_.walks, seed);
    if (!walks.ok()) return walks.status();
    const Result<std::vector<std::vector<PromiseJump>>> jumps = rig->Walk(*walks, kWalkSteps, trainings);
    if (!jumps.ok()) return jumps.status();
    for (std::size_t t = 0; t < cases.size(); ++t) {
      WalkRow& row = walks_.emplace_back(WalkRow{cases[t], walks->size(), 0, 0, ""});
      for (std::size_t w = 0; w < walks->size(); ++w) {
        const double jump = (*jumps)[t][w].excess / cases[t].tolerance;
        row.accepted += (*jumps)[t][w].accepted;
        if (jump > row.jump) row.jump = jump, row.control = rig->control_name((*walks)[w].control);
      }
    }
    const double walk_seconds = watch.Lap();
    total_.poses += pose_seconds, total_.walks += walk_seconds;
    Say(fmt::format("{}, seed {}: {} poses in {:.1f} s, {} rows broken; {} walks in {:.1f} s", name, seed,
                    poses_tried, pose_seconds, broken, walks->size(), walk_seconds));
    return Status();
  }

  const Options& options_;
  std::vector<PromiseRow> rows_;
  std::vector<WalkRow> walks_;
  Seconds total_;
};

int Main(int argc, char** argv) {
  InstallSignalHandlers();
  const Result<Options> options = ReadOptions(argc, argv);
  if (!options.ok()) {
    PrintErrors("bench_promise", options.status());
    return ExitCode(options.status());
  }
  const auto wanted = [&](const std::string& name) {
    return options->rigs.empty() ||
           std::find(options->rigs.begin(), options->rigs.end(), name) != options->rigs.end();
  };
  const InterruptScope scope;  // an interrupt ends the trying, and then there are tables still
  Bench bench(*options);
  Status failures;  // what can be tried is tried
  for (const std::string name : kScenes) {
    if (wanted(name))
      failures.Append(bench.TryRig(name, options->scenes + "/" + name + "/" + name + ".yaml"));
  }
  const ScratchFolder folder;
  for (const std::string name : kCharacters) {
    if (!wanted(name) || options->assets.empty() || Interrupted()) continue;
    const Result<std::string> rig =
        WriteStarterRig(options->assets + "/" + name + ".glb", name, folder.path());
    failures.Append(rig.ok() ? bench.TryRig(name, *rig) : rig.status());
  }
  const int code = bench.Report();
  if (!failures.ok()) PrintErrors("bench_promise", failures, 20);
  const Status flushed = FlushOutput();
  return !failures.ok() ? ExitCode(failures) : !flushed.ok() ? ExitCode(flushed) : code;
}

}  // namespace
}  // namespace kpsa::engine

int main(int argc, char** argv) { return kpsa::engine::Main(argc, argv); }
