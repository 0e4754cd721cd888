// kpsa learn: what a subspace misses in a clip becomes part of its training.
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>

#include "base/parallel.h"
#include "cli/command.h"
#include "cli/common.h"
#include "cli/frames_range.h"
#include "cli/interrupt.h"
#include "cli/memory_limit.h"
#include "cli/options.h"
#include "cli/output.h"
#include "cli/progress.h"
#include "host/learning.h"
#include "host/rig_training.h"
#include "kpsa/subspace.h"
#include "report/learn_text.h"

namespace kpsa::engine {
namespace {

struct LearnFlags : Flags {
  std::optional<std::string> name, kpsa, clips;
};

CommandResult RunLearn(LearnFlags flags) {
  KeepFreedMemory();
  const Result<int> threads = ThreadCount(flags);
  if (!threads.ok()) return threads.status();
  if (flags.rest) return Status::Usage("--rest: nothing moves in it, so there is nothing to learn");
  if (flags.clip.has_value() == flags.clips.has_value()) return Status::Usage("expected --clip or --clips");
  const std::vector<std::string> names = flags.clip ? std::vector{*flags.clip} : SplitNames(*flags.clips);
  flags.clip.reset();  // each plays in its turn
  if (names.empty()) return Status::Usage("--clips: expected the names of clips");
  if (flags.output == "-") return Status::Usage("-o -: expected a file name that ends in .kpsa");
  const Result<std::unique_ptr<OpenRig>> open = LoadRigOf(flags);
  if (!open.ok()) return open.status();
  Rig& rig = (*open)->rig;
  const Result<AccelerateEntry> entry = ChooseEntry(rig, flags.name);
  if (!entry.ok()) return Status(entry.status()).At({"--name"});
  const Result<std::vector<TrainingClip>> known = ClipFrames(rig, names);
  if (!known.ok()) return AsUsage(known.status());
  const std::string from = flags.kpsa.value_or(entry->subspace);
  if (from.empty())
    return Status::Usage("accelerate: \"{}\" names no subspace file: expected --kpsa FILE.kpsa", entry->name);
  const std::string path = flags.output.value_or(from);
  KPSA_RETURN_IF_ERROR(CheckOutput(path, flags.force, {".kpsa"}));
  Result<Subspace> read = ReadSubspace(from, KeptModes::kRead);
  if (!read.ok()) return read.status();
  const auto old = std::make_shared<const Subspace>(std::move(*read));
  if (old->of_light()) return Status::Usage("{}: it is of light, which has no frames to learn from", from);

  const ThreadLimit limit(*threads);
  const auto begin = std::chrono::steady_clock::now();
  Progress progress("learn", 0, flags.quiet);
  std::string stage;
  LearnOptions options;
  options.entry = flags.name;
  options.clips = names;
  options.subspace = from;
  options.watch = InterruptWatch();
  options.progress = [&](const char* what, double) {
    if (stage != what) progress.SetStage(fmt::format("learn: {}", what));
    stage = what;
    return true;
  };
  const RigOpener source = OpenerOf(flags);
  Result<LearnResult> result = LearnMisses(source, old, options);
  if (!result.ok()) return result.status();
  progress.Clear();
  if (result->subspace != nullptr) {
    {
      const InterruptScope writing;
      KPSA_RETURN_IF_ERROR(WriteSubspace(*result->subspace, path));
    }
    for (LearnResult::Clip& clip : result->clips) {
      Result<ClipTrial> trial = TryClip(source, clip.name, path, options.watch);
      if (!trial.ok()) return trial.status();
      clip.after = std::move(*trial);
    }
  } else if (path != from) {  // a file of its own all the same, where one was asked for
    KPSA_RETURN_IF_ERROR(WriteSubspace(*old, path));
  }
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  Print(flags.json ? LearnJson(*result, path, seconds) : LearnText(*result, path, seconds));
  return 0;
}

}  // namespace

void AddLearnCommand(CLI::App* program, Command* chosen) {
  auto flags = std::make_shared<LearnFlags>();
  CLI::App* command =
      AddCommand(program, "learn", "Teach a subspace what it misses in a clip",
                 "Evaluates the clips accelerated, adds the frames that miss or blend to the training poses, "
                 "and trains\n"
                 "again as that subspace was trained; what it promises is calibrated anew, on poses that it "
                 "never learnt.\n"
                 "The old file is replaced with --force only. What was learnt stays learnt the next time.\n"
                 "Examples:\n"
                 "  kpsa learn head.yaml --clip shot_12 --force\n"
                 "  kpsa learn head.yaml --kpsa head.kpsa --clips shot_12,shot_13 -o show.kpsa",
                 chosen, [flags] { return RunLearn(*flags); });
  AddRigFlags(command, flags.get());
  AddOutputFlags(command, flags.get(), "the new subspace, .kpsa; the old one's file if not given");
  AddOption(command, "--clips", "A,B,...", &flags->clips, "clips to learn from, in the place of --clip");
  AddOption(command, "--kpsa", "FILE", &flags->kpsa, "the subspace; the one that the rig names if not given");
  AddOption(command, "--name", "NAME", &flags->name,
            "an entry of the rig's accelerate section, where it has several");
  AddThreadsFlag(command, flags.get());
  AddQuietFlag(command, flags.get());
  AddJsonFlag(command, flags.get());
}

}  // namespace kpsa::engine
