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
#include "cli/rig_training.h"
#include "cli/verdicts.h"
#include "kpsa/training_record.h"

namespace kpsa {
namespace {

struct LearnFlags : Flags {
  std::optional<std::string> name, kpsa, clips;
};

// What a subspace makes of the frames of a clip.
struct ClipTrial {
  std::vector<double> times;  // of the frames, seconds
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
  RigFrameOptions options;
  options.quiet = true;
  KPSA_RETURN_IF_ERROR(
      EvaluateTimes(rig, *plan, *times, options, [&](std::size_t frame, const Evaluator& evaluator) {
        verdicts.Add(FrameNumber((*times)[frame], rig.fps), evaluator);
        return Status();
      }));
  ClipTrial trial;
  trial.times = *times;
  trial.hits = verdicts.hits();
  trial.blends = verdicts.count(FrameVerdict::kBlend), trial.misses = verdicts.count(FrameVerdict::kMiss);
  trial.reason = verdicts.MostFrequentReason();
  return trial;
}

// All frames of a clip of which some miss, besides those that were learnt before: what lies between two
// misses is as new as these, and a few poses among thousands would weigh nothing. Returns how many are new.
std::size_t Learn(const ClipTrial& trial, const std::string& clip, std::vector<TrainingClip>* learnt) {
  if (trial.blends + trial.misses == 0) return 0;
  auto known = std::ranges::find(*learnt, clip, &TrainingClip::name);
  if (known == learnt->end()) known = learnt->insert(learnt->end(), {clip, {}, true});
  const std::size_t before = known->times.size();
  known->times.insert(known->times.end(), trial.times.begin(), trial.times.end());
  std::ranges::sort(known->times);
  known->times.erase(std::unique(known->times.begin(), known->times.end()), known->times.end());
  return known->times.size() - before;
}

// As that training was asked for; what an older file does not tell is as the rig has it.
TrainOptions OptionsOf(const Subspace& subspace, const TrainingRecord& record, const Acceleration& entry) {
  TrainOptions options;
  options.seed = record.seed;
  options.tolerance = subspace.tolerance, options.violation_rate = subspace.violation_rate;
  options.keep_modes = subspace.kept_modes.size() > 0;
  if (record.mode == "paper") options.mode = EstimatorMode::kPaper;
  const TrainingRecord::Asked& asked = record.asked;
  const bool told = asked.rows > 0;
  options.samples = told ? std::min<std::size_t>(asked.samples, 1'000'000)
                         : static_cast<std::size_t>(std::max<std::int64_t>(0, entry.train_samples));
  if (!told) return options;
  options.calibration_poses = std::min<std::size_t>(asked.calibration, 100'000);
  options.rows = std::clamp<std::size_t>(asked.rows, 3, 3000);
  options.max_modes = static_cast<int>(std::clamp<std::size_t>(asked.modes, 1, 2000));
  (options.mode == EstimatorMode::kPaper ? options.key_points : options.min_points) =
      std::clamp<std::size_t>(asked.points, 2, 2000);
  options.may_have_cues_by_tile = asked.by_tile;
  return options;
}

struct Learnt {
  std::string clip;
  ClipTrial before, after;
};

std::string LearnJson(const std::string& path, const std::vector<Learnt>& clips, std::size_t poses,
                      double seconds) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  const auto counts = [](const ClipTrial& trial) {
    return nlohmann::ordered_json{{"hits", trial.hits}, {"blends", trial.blends}, {"misses", trial.misses}};
  };
  for (const Learnt& one : clips)
    list.push_back({{"clip", one.clip}, {"before", counts(one.before)}, {"after", counts(one.after)}});
  const nlohmann::ordered_json document = {{"schema", "kpsa.learn/1"},
                                           {"subspace", path},
                                           {"learnt", poses},
                                           {"clips", list},
                                           {"seconds", seconds}};
  return document.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

std::string LearnText(const std::string& path, const std::vector<Learnt>& clips, std::size_t poses,
                      double seconds) {
  std::string text = poses == 0 ? fmt::format("{}: there is nothing new to learn\n", path)
                                : fmt::format("{}: {} learnt, trained again in {:.1f} s\n", path,
                                              Plural(poses, "frame"), seconds);
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
  if (!entry.ok()) return entry.status();
  const Result<std::vector<TrainingClip>> known = ClipFrames(rig, names);
  if (!known.ok()) return AsUsage(known.status());
  const std::string from = flags.kpsa.value_or(entry->subspace);
  if (from.empty())
    return Status::Usage("accelerate: \"{}\" names no subspace file: expected --kpsa FILE.kpsa", entry->name);
  const std::string path = flags.output.value_or(from);
  KPSA_RETURN_IF_ERROR(CheckOutput(path, flags.force, {".kpsa"}));
  const Result<Subspace> old = ReadSubspace(from);
  if (!old.ok()) return old.status();
  if (old->of_light()) return Status::Usage("{}: it is of light, which has no frames to learn from", from);
  const TrainingRecord record = ParseTraining(old->training);

  const ThreadLimit limit(*threads);
  const auto begin = std::chrono::steady_clock::now();
  std::vector<TrainingClip> learnt;
  for (const auto& [clip, times] : record.learnt) learnt.push_back({clip, times, true});
  std::size_t poses = 0;
  std::vector<Learnt> result;
  for (const std::string& name : names) {
    Result<ClipTrial> trial = TryClip(flags, name, from);
    if (!trial.ok()) return trial.status();
    poses += Learn(*trial, name, &learnt);
    result.push_back({name, std::move(*trial), {}});
  }
  const auto report = [&] {
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    Print(flags.json ? LearnJson(path, result, poses, seconds) : LearnText(path, result, poses, seconds));
  };
  if (poses == 0) {  // a file of its own all the same, where one was asked for
    for (Learnt& one : result) one.after = one.before;
    if (path != from) KPSA_RETURN_IF_ERROR(WriteSubspace(*old, path));
    report();
    return 0;
  }

  Result<std::vector<TrainingClip>> clips = ClipFrames(rig, record.clips);
  if (!clips.ok()) return Status(clips.status()).At({from});
  clips->insert(clips->end(), learnt.begin(), learnt.end());
  TrainOptions options = OptionsOf(*old, record, *entry);
  Progress progress("learn", 0, flags.quiet);
  std::string stage;
  options.progress = [&](const char* what, double) {
    if (stage != what) progress.SetStage(fmt::format("learn: {}", what));
    stage = what;
    return true;
  };
  const Result<Subspace> trained = Train(MakeTrainingRig(&rig, *entry), *clips, options);
  if (!trained.ok()) return Status(trained.status()).At({rig.path});
  progress.Clear();
  {
    const InterruptScope writing;
    KPSA_RETURN_IF_ERROR(WriteSubspace(*trained, path));
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

}  // namespace kpsa
