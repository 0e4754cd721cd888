// kpsa train: a rig to a subspace.
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>

#include "base/parallel.h"
#include "cli/acceleration.h"
#include "cli/command.h"
#include "cli/frames_range.h"
#include "cli/interrupt.h"
#include "cli/memory_limit.h"
#include "cli/options.h"
#include "cli/output.h"
#include "cli/progress.h"
#include "files/quantity.h"
#include "host/checks/playback_times.h"
#include "host/checks/stack_cost.h"
#include "host/checks/subspace_check.h"
#include "host/rig_training.h"
#include "report/stack_cost_text.h"
#include "report/train_report.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kCheckPoses = 60, kLightCheckPoses = 4;  // light takes seconds a pose

struct TrainFlags : Flags {
  std::optional<std::string> name, samples, clips, seed, rows, modes, key_points, tolerance, violation_rate,
      calibration, speedup, time;
  bool paper = false, keep_modes = false;
};

// All numbers of the flags, over those of the rig's entry.
Status ReadOptions(const TrainFlags& flags, TrainOptions* options) {
  const auto count = [](const char* what, const std::optional<std::string>& text, int low, int high,
                        auto* to) -> Status {
    if (!text.has_value()) return Status();
    const Result<int> value = ParseCount(what, *text, low, high);
    if (!value.ok()) return value.status();
    *to = static_cast<std::remove_pointer_t<decltype(to)>>(*value);
    return Status();
  };
  KPSA_RETURN_IF_ERROR(count("--samples", flags.samples, 0, 1'000'000, &options->samples));
  KPSA_RETURN_IF_ERROR(count("--calibration", flags.calibration, 20, 100'000, &options->calibration_poses));
  KPSA_RETURN_IF_ERROR(count("--seed", flags.seed, 0, 2'000'000'000, &options->seed));
  KPSA_RETURN_IF_ERROR(count("--rows", flags.rows, 3, 3000, &options->rows));
  KPSA_RETURN_IF_ERROR(count("--modes", flags.modes, 1, 2000, &options->max_modes));
  KPSA_RETURN_IF_ERROR(count("--key-points", flags.key_points, 2, 2000,
                             flags.paper ? &options->key_points : &options->min_points));
  if (flags.paper) options->mode = EstimatorMode::kPaper;
  options->may_have_cues_by_tile = !flags.rows && !flags.modes;
  options->keep_modes = flags.keep_modes;
  if (flags.tolerance.has_value()) {
    const Result<double> value = ParseLength("--tolerance", *flags.tolerance);
    if (!value.ok()) return value.status();
    if (!(*value > 0))
      return Status::Usage(
          "--tolerance \"{}\": expected a length above 0, as in 1mm; at 0 nothing is ever accepted",
          *flags.tolerance);
    options->tolerance = *value;
  }
  if (flags.time.has_value()) {
    const Result<double> value = ParseQuantity(*flags.time, Unit::kTime, FileUnits());
    if (!value.ok() || !(*value > 0))
      return Status::Usage("--time \"{}\": expected seconds above 0, as in 60s", *flags.time);
    options->seconds = *value;
  }
  if (flags.violation_rate.has_value()) {
    const Result<double> value = ParseRate(*flags.violation_rate);
    if (!value.ok()) return value.status();
    options->violation_rate = *value;
  }
  return Status();
}

CommandResult RunTrain(const TrainFlags& flags) {
  KeepFreedMemory();
  const Result<int> threads = ThreadCount(flags);
  if (!threads.ok()) return threads.status();
  TrainOptions options;
  KPSA_RETURN_IF_ERROR(ReadOptions(flags, &options));
  double wanted_speedup = 0;
  if (flags.speedup.has_value()) {
    const Result<double> value = ParseSpeedup(*flags.speedup);
    if (!value.ok()) return value.status();
    wanted_speedup = *value;
  }
  if (flags.output.has_value()) KPSA_RETURN_IF_ERROR(CheckOutput(*flags.output, flags.force, {".kpsa"}));
  if (flags.output == "-") return Status::Usage("-o -: expected a file name that ends in .kpsa");
  const Result<std::unique_ptr<OpenRig>> open = LoadRigOf(flags);
  if (!open.ok()) return open.status();
  Rig& rig = (*open)->rig;
  const Result<AccelerateEntry> entry = ChooseEntry(rig, flags.name);
  if (!entry.ok()) return Status(entry.status()).At({"--name"});
  const std::string path = flags.output.value_or(entry->subspace);
  if (path.empty())
    return Status::Usage("accelerate: \"{}\" names no subspace file: expected -o FILE.kpsa", entry->name);
  KPSA_RETURN_IF_ERROR(CheckOutput(path, flags.force, {".kpsa"}));
  options = TrainOptionsOf(rig, *entry);
  KPSA_RETURN_IF_ERROR(ReadOptions(flags, &options));  // which were looked at before the rig was loaded
  if (flags.clips.has_value()) {
    for (const std::string& clip : SplitNames(*flags.clips)) {
      if (std::find(entry->test_clips.begin(), entry->test_clips.end(), clip) != entry->test_clips.end())
        return Status::Usage(
            "--clips {}: a test clip of the rig, which is never trained on (test: in its accelerate section)",
            clip);
    }
  }
  const Result<std::vector<TrainingClip>> clips =
      ClipFrames(rig, flags.clips.has_value() ? SplitNames(*flags.clips) : entry->train_clips);
  if (!clips.ok()) return flags.clips.has_value() ? AsUsage(clips.status()) : clips.status();

  if (!flags.force) {
    // What cannot be timed goes to training, which says why
    if (const auto cost = MeasureStack(**open, OpenerOf(flags), *entry, *clips, InterruptWatch());
        cost.ok() && !cost->worth_it()) {
      Print(flags.json ? NotWorthItJson(*cost) : NotWorthItText(*cost, flags.file));
      return 1;
    }
  }

  // Nothing is written before the end, so an interrupt may end the program at any time
  const ThreadLimit limit(*threads);
  const auto begin = std::chrono::steady_clock::now();
  Progress progress("train", 0, flags.quiet);
  std::string stage;
  // How long a stage takes depends on the rig, so only what is counted has a time left
  options.progress = [&](const char* what, double) {
    if (stage != what) progress.SetStage(fmt::format("train: {}", what));
    stage = what;
    return true;
  };
  Result<Subspace> trained = Train(MakeTrainingRig(&rig, *entry), *clips, options);
  if (!trained.ok()) return Status(trained.status()).At({rig.path});
  const auto subspace = std::make_shared<const Subspace>(std::move(*trained));
  const TrainingRecord record = ParseTraining(subspace->training);
  const Calibration calibration =
      Calibrate(subspace->calibration, subspace->tolerance, subspace->violation_rate, subspace->blend_start);
  SubspaceCheckOptions check_options;
  check_options.poses = subspace->of_light() ? kLightCheckPoses : kCheckPoses;
  check_options.seed = options.seed ^ 0x9e3779b97f4a7c15ull;
  check_options.groups = options.samples > 0 && !subspace->of_light();
  progress.SetStage("train: timing it");
  const Result<PlaybackTimes> played =
      TimePlayback(OpenerOf(flags), *entry, subspace, *clips, InterruptWatch());
  if (!played.ok()) return Status(played.status()).At({rig.path});
  check_options.played = *played;
  progress.SetLabel("train: trying it, poses", check_options.poses);
  check_options.watch = progress.watch();
  const Result<SubspaceCheck> check = CheckSubspace(&rig, *entry, subspace, *clips, check_options);
  if (!check.ok()) return Status(check.status()).At({rig.path});
  progress.Clear();
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  const InterruptScope writing;
  KPSA_RETURN_IF_ERROR(WriteSubspace(*subspace, path));
  std::string worst_path;
  if (!record.worst.kind.empty()) {
    worst_path = std::filesystem::path(path).replace_extension(".worst.yaml").string();
    KPSA_RETURN_IF_ERROR(WriteText(worst_path, true, WorstPoseText(record, path)));
  }
  const TrainResult result{flags.file,
                           path,
                           !flags.output.has_value(),
                           subspace,
                           record,
                           calibration,
                           *check,
                           seconds,
                           worst_path,
                           TrainedTolerances(*subspace, *check, wanted_speedup)};
  Print(flags.json ? TrainJson(result) : TrainText(result));
  if (!flags.quiet && !record.warning.empty()) Say("warning: " + record.warning);
  // What is not promised is told in any case
  if (!calibration.warning.empty()) Say("warning: " + calibration.warning);
  return 0;
}

}  // namespace

void AddTrainCommand(CLI::App* program, Command* chosen) {
  auto flags = std::make_shared<TrainFlags>();
  CLI::App* command = AddCommand(
      program, "train", "Learn a subspace from a rig's clips and controls",
      "Test clips of the rig are never trained on. An existing subspace is replaced with --force only.\n"
      "A stack that costs too little for acceleration to pay is trained with --force only, too (else: exit\n"
      "status 1, and what a frame costs).\n"
      "Examples:\n"
      "  kpsa train head.yaml\n"
      "  kpsa train head.yaml --samples 4000 --tolerance 0.1mm -o fine.kpsa\n"
      "  kpsa train head.yaml --speedup 10\n"
      "  kpsa train head.yaml --paper --key-points 80 -o paper.kpsa",
      chosen, [flags] { return RunTrain(*flags); });
  AddRigFlags(command, flags.get());
  AddOutputFlags(command, flags.get(), "the subspace, .kpsa; the one that the rig names if not given");
  AddOption(command, "--name", "NAME", &flags->name,
            "an entry of the rig's accelerate section, where it has several");
  AddOption(command, "--clips", "A,B,...", &flags->clips, "train on these clips instead of the rig's");
  AddOption(command, "--samples", "N", &flags->samples,
            "poses drawn from the controls; the rig's number if not given");
  AddOption(command, "--calibration", "N", &flags->calibration,
            "held-out poses of each kind that the tolerance is calibrated with; 400 to 1000, by the rate, "
            "and fewer where --time is short, if not given");
  AddOption(command, "--seed", "N", &flags->seed, "of the sampled poses; 1 if not given");
  AddOption(command, "--rows", "N", &flags->rows,
            "numbers measured a frame (a point has three), at most; as many as pay if not given");
  AddOption(command, "--modes", "N", &flags->modes, "modes at most; as many as pay if not given");
  AddOption(command, "--tolerance", "LENGTH", &flags->tolerance, "the largest error of a point, as in 0.2mm");
  AddOption(command, "--violation-rate", "SHARE", &flags->violation_rate,
            "share of frames that may exceed it, as in 1%");
  AddOption(
      command, "--speedup", "FACTOR", &flags->speedup,
      "tell the smallest tolerance that is expected to reach it, misses included; training stays as it is");
  AddOption(command, "--time", "SECONDS", &flags->time,
            "about how long to train at most, as in 60s: fewer poses, no cues of each tile, and a shorter "
            "calibration, where that is too short");
  AddSwitch(command, "--paper", &flags->paper,
            "the method of the paper: key points of varimax modes, least squares");
  AddOption(command, "--key-points", "N", &flags->key_points,
            "points that are measured: with --paper so many, else at least so many, besides --rows if need "
            "be; the rig's keyPoints, else 80 and 16, if not given");
  AddSwitch(command, "--keep-modes", &flags->keep_modes,
            "store the modes as well, so that bench can split the error of each frame");
  AddThreadsFlag(command, flags.get());
  AddQuietFlag(command, flags.get());
  AddJsonFlag(command, flags.get());
}

}  // namespace kpsa::engine
