// What each part of the method is worth.
//   bench_ablation [RIG] [SAMPLES]        choices of cues at equal numbers of points; errors on the rig's
//   test clip in
//                                         its space, % of the diagonal, beside them the time of the cues
//                                         alone
//   bench_ablation --dump FILE.npz [RIG] [SAMPLES]    the same poses for bench/baselines.py
//   bench_ablation --parts [RIG] [SAMPLES]            trained without one part at a time, misses included
// The rig's first accelerate entry; scenes/face/face.yaml and its number of samples if not given.
//   --only PART     in --parts, besides everything; may be given several times; all if not given
//   --key-points N  of paper mode in --parts; 80 if not given
//   --runs N        timed evaluations of every frame in --parts; 5 if not given
//   --markdown      the table of --parts as Markdown
// Exit code 2 usage, 3 a rig that cannot be tried.
#include <fmt/format.h>
#include <stdlib.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "bench/ablation_parts.h"
#include "bench/ablation_points.h"
#include "cli/common.h"
#include "cli/frames_range.h"

namespace kpsa::engine::ablation {
namespace {

constexpr std::size_t kPointCounts[] = {10, 20, 40, 80};

struct AblationOptions {
  std::string rig = "scenes/face/face.yaml", dump;
  std::vector<std::string> only;
  bool parts = false, markdown = false;
  int samples = 0, key_points = 80, runs = 5;  // samples 0: the rig's
};

Result<AblationOptions> ReadAblationOptions(int argc, char** argv) {
  AblationOptions options;
  std::size_t positional = 0;
  for (int i = 1; i < argc; ++i) {
    const std::string name = argv[i];
    if (name == "--parts" || name == "--markdown") {
      (name == "--parts" ? options.parts : options.markdown) = true;
    } else if (name == "--dump" || name == "--only" || name == "--key-points" || name == "--runs") {
      if (++i == argc) return Status::Usage("{}: expected a value", name);
      if (name == "--dump") options.dump = argv[i];
      if (name == "--only") options.only.emplace_back(argv[i]);
      if (name == "--dump" || name == "--only") continue;
      const Result<int> count = ParseCount(name, argv[i], 2, 1000);
      if (!count.ok()) return count.status();
      (name == "--runs" ? options.runs : options.key_points) = *count;
    } else if (name.starts_with("-") || positional == 2) {
      return Status::Usage(
          "{}: expected [RIG] [SAMPLES], --dump FILE.npz, --parts, --only PART, --key-points N, --runs N or "
          "--markdown",
          name);
    } else if (positional++ == 0) {
      options.rig = name;
    } else {
      const Result<int> samples = ParseCount("samples", name, 0, 100'000);
      if (!samples.ok()) return samples.status();
      options.samples = *samples;
    }
  }
  for (const std::string& name : options.only) {
    std::vector<std::string> known;
    for (const Part& part : Parts()) known.emplace_back(part.what);
    if (std::ranges::find(known, name) == known.end())
      return Status::Usage("--only {}: expected {}", name, fmt::join(known, ", "));
  }
  if (options.parts && !options.dump.empty()) return Status::Usage("--dump: not with --parts");
  return options;
}

// The subspaces are written there.
class ScratchFolder {
 public:
  ScratchFolder() {
    std::error_code error;
    std::string name = (std::filesystem::temp_directory_path(error) / "kpsa_ablation_XXXXXX").string();
    if (!error && ::mkdtemp(name.data()) != nullptr) path_ = name;
  }
  ~ScratchFolder() {
    std::error_code error;
    if (!path_.empty()) std::filesystem::remove_all(path_, error);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

Status RunParts(const AblationOptions& options) {
  const ScratchFolder folder;
  if (folder.path().empty()) return Status::Invalid("no temporary folder can be made");
  PartsOptions parts;
  parts.folder = folder.path();
  parts.runs = options.runs;
  parts.key_points = static_cast<std::size_t>(options.key_points);
  parts.samples = static_cast<std::size_t>(options.samples);
  parts.progress = [](const std::string& what) { Say(what + " ..."); };
  std::vector<Part> wanted = Parts();
  if (!options.only.empty()) {
    wanted.erase(std::remove_if(wanted.begin() + 1, wanted.end(),
                                [&](const Part& part) {
                                  return std::ranges::find(options.only, part.what) == options.only.end();
                                }),
                 wanted.end());
  }
  const Result<std::vector<PartsRow>> rows = CompareParts(options.rig, wanted, parts);
  if (!rows.ok()) return rows.status();
  Print(options.markdown ? PartsMarkdown(*rows) : PartsText(*rows));
  return FlushOutput();
}

Status RunPoints(const AblationOptions& options) {
  AblationPoses poses;
  KPSA_RETURN_IF_ERROR(poses.Load(options.rig, static_cast<std::size_t>(options.samples)));
  if (!options.dump.empty()) return poses.Dump(options.dump);
  fmt::print(
      "{}: {} points, {} training poses, {} test frames of {}; motion RMS {:.3f} % of the diagonal of {:.3f} "
      "m; "
      "{} modes\n",
      options.rig, poses.pca.layout.points, poses.training->poses(), poses.test->poses(),
      poses.entry.test_clips[0], 100 * poses.motion_rms / poses.diagonal, poses.diagonal,
      poses.pca.mode_count());
  fmt::print("the last stage but one: {}\n\n{}", poses.stage.empty() ? "none" : poses.stage,
             PointsHeader(kPointCounts));
  ComparePoints(&poses, kPointCounts, [](const PointsRow& row) {
    fmt::print("{}", PointsText(row));
    std::fflush(stdout);
  });
  return Status();
}

int Main(int argc, char** argv) {
  const Result<AblationOptions> options = ReadAblationOptions(argc, argv);
  const Status status = !options.ok()    ? options.status()
                        : options->parts ? RunParts(*options)
                                         : RunPoints(*options);
  if (!status.ok()) PrintErrors("bench_ablation", status);
  return status.ok() ? 0 : ExitCode(status);
}

}  // namespace
}  // namespace kpsa::engine::ablation

int main(int argc, char** argv) { return kpsa::engine::ablation::Main(argc, argv); }
