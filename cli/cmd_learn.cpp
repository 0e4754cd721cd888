// kpsa learn: what a subspace misses in a clip becomes part of its training.
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "base/parallel.h"
#include "cli/acceleration.h"
#include "cli/command.h"
#include "cli/common.h"
#include "cli/frames_range.h"
#include "cli/options.h"
#include "cli/output.h"
#include "cli/progress.h"
#include "cli/rig_frames.h"
#include "cli/verdicts.h"
#include "host/rig_training.h"
#include "kpsa/training/learner.h"
#include "kpsa/training/tile_splice.h"
#include "kpsa/training_record.h"

namespace kpsa::engine {
namespace {

struct LearnFlags : Flags {
  std::optional<std::string> name, kpsa, clips;
};

// What a subspace makes of the frames of a clip.
struct ClipTrial {
  std::vector<Miss> missed;
  std::size_t hits = 0, blends = 0, misses = 0;
  std::string reason;  // the most frequent one
};

Result<ClipTrial> TryClip(Flags flags, const std::string& clip, const std::string& subspace) {
  flags.clip = clip;
  const Result<std::unique_ptr<OpenRig>> open = LoadRigOf(flags);
  if (!open.ok()) return open.status();
  Rig& rig = (*open)->rig;
  const Result<std::vector<double>> times = SampleTimes(flags, **open);
  if (!times.ok()) return times.status();
  Compiler compiler;
  AccelerationFlags acceleration;
  acceleration.kpsa = subspace;
  const Result<std::vector<AppliedSubspace>> applied = ApplyAcceleration(&rig, &compiler, acceleration);
  if (!applied.ok()) return applied.status();
  Request request;
  request.varying = VaryingPlugs(rig);
  Verdicts verdicts(*applied);
  verdicts.Ask(rig, &request);
  const auto plan = CompileFor(rig, &compiler, request);
  if (!plan.ok()) return plan.status();
  ClipTrial trial;
  RigFrameOptions options;
  options.quiet = true;
  KPSA_RETURN_IF_ERROR(
      EvaluateTimes(rig, *plan, *times, options, [&](std::size_t frame, const Evaluator& evaluator) {
        verdicts.Add(FrameNumber((*times)[frame], rig.fps), evaluator);
        if (!verdicts.records().back().decision.hit()) trial.missed.push_back({clip, (*times)[frame]});
        return Status();
      }));
  trial.hits = verdicts.hits();
  trial.blends = verdicts.count(FrameVerdict::kBlend), trial.misses = verdicts.count(FrameVerdict::kMiss);
  trial.reason = verdicts.MostFrequentReason();
  return trial;
}

// The rig of the flags once more, for the learner alone.
Result<LearnerRig> OpenForLearner(const LearnFlags& flags) {
  Result<std::unique_ptr<OpenRig>> opened = LoadRigOf(flags);
  if (!opened.ok()) return opened.status();
  const std::shared_ptr<OpenRig> open = std::move(*opened);
  const Result<Acceleration> entry = ChooseEntry(open->rig, flags.name);
  if (!entry.ok()) return Status(entry.status()).At({"--name"});
  LearnerRig rig;
  rig.owner = open;
  rig.training = MakeTrainingRig(&open->rig, *entry);
  rig.frames = [open](const std::string& clip) -> Result<TrainingClip> {
    Result<std::vector<TrainingClip>> clips = ClipFrames(open->rig, {clip});
    if (!clips.ok()) return clips.status();
    return std::move(clips->front());
  };
  rig.samples = static_cast<std::size_t>(std::max<std::int64_t>(0, entry->train_samples));
  return rig;
}

// Of tiles that learn by themselves: how many there are, and how many learnt nothing.
struct TileCounts {
  std::size_t all = 0, kept = 0;
};
TileCounts CountTiles(const Subspace& before, const Subspace& after) {
  TileCounts counts;
  if (!before.by_tile() || !after.by_tile()) return counts;
  for (std::size_t m = 0; m < std::min(before.tiles.size(), after.tiles.size()); ++m) {
    const std::vector<char> same = SameTiles(before.tiles[m], after.tiles[m]);
    counts.all += same.size();
    counts.kept += static_cast<std::size_t>(std::ranges::count(same, 1));
  }
  return counts;
}

std::size_t LearntFrames(const Subspace& subspace) {
  std::size_t frames = 0;
  for (const auto& [clip, times] : ParseTraining(subspace.training).learnt) frames += times.size();
  return frames;
}

struct Learnt {
  std::string clip;
  ClipTrial before, after;
};

std::string LearnJson(const std::string& path, const std::vector<Learnt>& clips, std::size_t poses,
                      const TileCounts& tiles, double seconds) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  const auto counts = [](const ClipTrial& trial) {
    return nlohmann::ordered_json{{"hits", trial.hits}, {"blends", trial.blends}, {"misses", trial.misses}};
  };
  for (const Learnt& one : clips)
    list.push_back({{"clip", one.clip}, {"before", counts(one.before)}, {"after", counts(one.after)}});
  nlohmann::ordered_json document = {{"schema", "kpsa.learn/1"},
                                     {"subspace", path},
                                     {"learnt", poses},
                                     {"clips", list},
                                     {"seconds", seconds}};
  if (tiles.all > 0) document["tiles"] = {{"all", tiles.all}, {"kept", tiles.kept}};
  return document.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

std::string LearnText(const std::string& path, const std::vector<Learnt>& clips, std::size_t poses,
                      const TileCounts& tiles, double seconds) {
  std::string text = poses == 0 ? fmt::format("{}: there is nothing new to learn\n", path)
                                : fmt::format("{}: {} learnt, trained again in {:.1f} s\n", path,
                                              Plural(poses, "frame"), seconds);
  if (tiles.all > 0)
    text += fmt::format("{} of {} had nothing to learn, and are as they were\n", tiles.kept,
                        Plural(tiles.all, "tile"));
  for (const Learnt& one : clips) {
    const auto counts = [](const ClipTrial& t) { return CountsText(t.hits, t.blends, t.misses); };
    text += fmt::format("{}: {}", one.clip, counts(one.before));
    if (poses > 0) text += "; now " + counts(one.after);
    text += "\n";
    if (!one.after.reason.empty()) text += one.after.reason + "\n";
  }
  return text;
}

CommandResult RunLearn(LearnFlags flags) {
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
  const Result<Acceleration> entry = ChooseEntry(rig, flags.name);
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
  LearnerOptions options;
  options.threads = 0;  // nothing else is done meanwhile
  options.progress = [&](const char* what, double) {
    if (stage != what) progress.SetStage(fmt::format("learn: {}", what));
    stage = what;
    return true;
  };
  Learner learner(
      old, [&flags] { return OpenForLearner(flags); }, std::move(options));
  std::size_t poses = 0;
  TileCounts tiles;
  std::vector<Learnt> result;
  for (const std::string& name : names) {
    Result<ClipTrial> trial = TryClip(flags, name, from);
    if (!trial.ok()) return trial.status();
    for (const Miss& miss : trial->missed) learner.Add(miss);
    result.push_back({name, std::move(*trial), {}});
  }
  const auto report = [&] {
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    Print(flags.json ? LearnJson(path, result, poses, tiles, seconds)
                     : LearnText(path, result, poses, tiles, seconds));
  };
  if (!learner.Learn()) {  // a file of its own all the same, where one was asked for
    for (Learnt& one : result) one.after = one.before;
    if (path != from) KPSA_RETURN_IF_ERROR(WriteSubspace(*old, path));
    report();
    return 0;
  }
  KPSA_RETURN_IF_ERROR(learner.Wait().At({rig.path}));
  const std::shared_ptr<const Subspace> learnt = learner.TakeNewest();
  poses = LearntFrames(*learnt) - LearntFrames(*old);
  tiles = CountTiles(*old, *learnt);
  progress.Clear();
  {
    const InterruptScope writing;
    KPSA_RETURN_IF_ERROR(WriteSubspace(*learnt, path));
  }
  for (Learnt& one : result) {
    Result<ClipTrial> trial = TryClip(flags, one.clip, path);
    if (!trial.ok()) return trial.status();
    one.after = std::move(*trial);
  }
  report();
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
