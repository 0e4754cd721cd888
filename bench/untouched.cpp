// What the program does for characters that nobody tuned it for: makes a body, a head and a creature from a
// seed, runs `kpsa init`, `train` and `bench` on each with nothing changed, and prints one table.
//   bench_untouched [--seed N] [--assets FOLDER] [--only NAME]... [--points N] [--samples N] [--keep FOLDER] [--markdown]
// --assets: also human.glb, head.glb, Fox.glb and robot.glb of that folder. --only takes names of the table's
// first column. --points: of each character that is made, about so many. --samples: of `kpsa train`, for how its
// memory grows. --keep: characters, rigs, subspaces and the program's JSON stay in that folder, one of their
// own a character. The table comes at the end, or at an interrupt of what there is. Exit code 1 if a promise
// is broken on a test clip, 2 usage, 3 a character that cannot be tried.
#include <fmt/format.h>
#include <stdlib.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "bench/untouched_character.h"
#include "bench/untouched_run.h"
#include "cli/common.h"
#include "cli/frames_range.h"
#include "cli/interrupt.h"

namespace kpsa::engine::untouched {
namespace {

namespace fs = std::filesystem;

constexpr const char* kAssets[] = {"human.glb", "head.glb", "Fox.glb", "robot.glb"};

struct Options {
  std::uint64_t seed = 1;
  std::string assets, keep;
  std::vector<std::string> only;  // none: all
  std::size_t points = 0;         // 0: as many as there usually are
  std::string samples;            // empty: as many as the program takes
  bool markdown = false;
  bool Wants(const std::string& name) const {
    return only.empty() || std::find(only.begin(), only.end(), name) != only.end();
  }
};

Result<Options> ReadOptions(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; ++i) {
    const std::string name = argv[i];
    if (name == "--markdown") {
      options.markdown = true;
      continue;
    }
    if (name != "--seed" && name != "--assets" && name != "--only" && name != "--points" &&
        name != "--samples" && name != "--keep")
      return Status::Usage(
          "{}: expected --seed N, --assets FOLDER, --only NAME, --points N, --samples N, --keep FOLDER or "
          "--markdown",
          name);
    if (++i == argc) return Status::Usage("{}: expected a value", name);
    const std::string value = argv[i];
    if (name == "--assets") options.assets = value;
    if (name == "--keep") options.keep = value;
    if (name == "--seed" || name == "--points") {
      const Result<int> number = ParseCount(name, value, name == "--seed" ? 0 : 1000, 1'000'000);
      if (!number.ok()) return number.status();
      if (name == "--seed") options.seed = static_cast<std::uint64_t>(*number);
      if (name == "--points") options.points = static_cast<std::size_t>(*number);
    }
    if (name == "--samples") options.samples = value;
    if (name == "--only") options.only.push_back(value);
  }
  std::vector<std::string> names;
  for (const Kind kind : kKinds) names.push_back(KindName(kind));
  names.insert(names.end(), std::begin(kAssets), std::end(kAssets));
  for (const std::string& name : options.only) {
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end()) return Status::Usage("--only {}: expected {}", name, fmt::join(names, ", "));
    if (name.ends_with(".glb") && options.assets.empty())
      return Status::Usage("--only {}: expected its folder with --assets", name);
  }
  return options;
}

// Where all is written: the folder of --keep, or one that is removed.
class Workshop {
 public:
  explicit Workshop(const std::string& keep) : path_(keep), is_scratch_(keep.empty()) {
    std::error_code error;
    if (!is_scratch_) return;
    std::string name = (fs::temp_directory_path(error) / "kpsa_untouched_XXXXXX").string();
    if (!error && ::mkdtemp(name.data()) != nullptr) path_ = name;
  }
  ~Workshop() {
    std::error_code error;
    if (is_scratch_ && !path_.empty()) fs::remove_all(path_, error);
  }
  Workshop(const Workshop&) = delete;
  Workshop& operator=(const Workshop&) = delete;
  Result<std::string> Folder(const std::string& name) const {
    const fs::path folder = fs::path(path_) / name;
    std::error_code error;
    if (!path_.empty()) fs::create_directories(folder, error);
    if (path_.empty() || error) return Status::Invalid("cannot be made").At({folder.string()});
    return folder.string();
  }

 private:
  std::string path_;
  bool is_scratch_;
};

class Bench {
 public:
  explicit Bench(const Options& options) : options_(options), workshop_(options.keep) {}

  int Run() {
    Status failures;  // what can be tried is tried
    for (const Kind kind : kKinds) {
      if (options_.Wants(KindName(kind)) && !Interrupted()) failures.Append(TryKind(kind));
    }
    for (const std::string name : kAssets) {
      if (options_.Wants(name) && !options_.assets.empty() && !Interrupted())
        failures.Append(Try(name, options_.assets + "/" + name));
    }
    if (!rows_.empty()) Print(options_.markdown ? RowsMarkdown(rows_) : RowsText(rows_));
    if (!failures.ok()) {
      PrintErrors("bench_untouched", failures, 20);
      return ExitCode(failures);
    }
    const Status flushed = FlushOutput();
    if (!flushed.ok()) return ExitCode(flushed);
    return std::all_of(rows_.begin(), rows_.end(), [](const Row& row) { return row.kept; }) ? 0 : 1;
  }

 private:
  Status TryKind(Kind kind) {
    const std::string name = KindName(kind);
    const Result<std::string> folder = workshop_.Folder(name);
    if (!folder.ok()) return folder.status();
    const std::string path = *folder + "/" + name + ".glb";
    std::ofstream file(path, std::ios::binary);
    file << scenes::WriteGlb(
        MakeCharacter(kind, options_.seed, options_.points > 0 ? options_.points : UsualPoints(kind)));
    if (!file.flush()) return Status::Invalid("cannot be written").At({path});
    return Try(name, path);
  }

  Status Try(const std::string& name, const std::string& path) {
    const Result<std::string> folder = workshop_.Folder(name);
    if (!folder.ok()) return folder.status();
    Say(fmt::format("{}: kpsa init, train, bench ...", name));
    std::vector<std::string> options;
    if (!options_.samples.empty()) options = {"--samples", options_.samples};
    Result<Row> row = TryCharacter(KPSA_PROGRAM, name, path, *folder, options);
    if (!row.ok()) return row.status();
    rows_.push_back(std::move(*row));
    return Status();
  }

  const Options& options_;
  Workshop workshop_;
  std::vector<Row> rows_;
};

int Main(int argc, char** argv) {
  InstallSignalHandlers();
  const Result<Options> options = ReadOptions(argc, argv);
  if (!options.ok()) {
    PrintErrors("bench_untouched", options.status());
    return ExitCode(options.status());
  }
  const InterruptScope scope;  // an interrupt ends the trying, and then there is a table still
  return Bench(*options).Run();
}

}  // namespace
}  // namespace kpsa::engine::untouched

int main(int argc, char** argv) { return kpsa::engine::untouched::Main(argc, argv); }
