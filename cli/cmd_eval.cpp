// kpsa eval: a rig or character to a vertex cache.
#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>

#include "base/parallel.h"
#include "cli/acceleration.h"
#include "cli/command.h"
#include "cli/common.h"
#include "cli/frames_range.h"
#include "cli/interrupt.h"
#include "cli/options.h"
#include "cli/output.h"
#include "cli/progress.h"
#include "cli/vertex_output.h"
#include "host/finite_points.h"
#include "host/rig_frames.h"
#include "host/skin_record.h"
#include "host/verdicts.h"
#include "report/verdict_text.h"

namespace kpsa::engine {
namespace {

struct EvalFlags : Flags {
  AccelerationFlags acceleration;
  bool blender = false, skinned = false, no_skinned = false;
};

// Of a .glb: what joints and morph targets alone do. None for other files, and where nobody wants it.
Status MakeSkinRecord(const EvalFlags& flags, const Rig& rig, const std::vector<std::size_t>& shown,
                      std::size_t frames, std::optional<SkinRecord>* skins) {
  if (flags.no_skinned || FileSuffix(*flags.output) != ".glb") return Status();
  skins->emplace(rig, shown, frames);
  for (std::size_t m = 0; m < shown.size() && flags.skinned; ++m) {
    const std::string& reason = (*skins)->reasons()[m];
    if (!reason.empty())
      return Status::Usage("--skinned: mesh \"{}\" {}; without it, such meshes are written as morph targets",
                           rig.scene.meshes[shown[m]].name, reason);
  }
  return Status();
}

CommandResult Eval(const EvalFlags& flags) {
  // Whatever can be refused without the rig
  KPSA_RETURN_IF_ERROR(CheckTimeFlags(flags));
  const Result<int> threads = ThreadCount(flags);
  if (!threads.ok()) return threads.status();
  if (!flags.output.has_value())
    return Status::Usage("expected -o with a name that ends in {}, or - for .npz to stdout",
                         fmt::join(VertexSuffixes(), ", "));
  KPSA_RETURN_IF_ERROR(CheckOutput(*flags.output, flags.force, VertexSuffixes()));
  KPSA_RETURN_IF_ERROR(CheckAccelerationFlags(flags.acceleration, flags.acceleration.wanted()));
  if (*flags.output == "-" && flags.json) return Status::Usage("-o - and --json: stdout takes one of them");
  if (flags.blender && FileSuffix(*flags.output) != ".pc2" && FileSuffix(*flags.output) != ".mdd") {
    return Status::Usage("--blender is for .pc2 and .mdd files, found {}", *flags.output);
  }
  if (flags.skinned && flags.no_skinned)
    return Status::Usage("--skinned and --no-skinned: expected one of them");
  if ((flags.skinned || flags.no_skinned) && FileSuffix(*flags.output) != ".glb") {
    return Status::Usage("{} is for .glb files, found {}", flags.skinned ? "--skinned" : "--no-skinned",
                         *flags.output);
  }

  const ThreadLimit limit(*threads);
  const auto begin = std::chrono::steady_clock::now();
  const Result<std::unique_ptr<OpenRig>> open = LoadRigOf(flags);
  if (!open.ok()) return open.status();
  Rig& rig = (*open)->rig;
  const Result<std::vector<double>> times = SampleTimes(flags, **open);
  if (!times.ok()) return times.status();
  KPSA_RETURN_IF_ERROR(CheckNotInput(*flags.output, rig.files));
  Compiler compiler;
  std::vector<AppliedSubspace> applied;
  if (flags.acceleration.wanted()) {
    Result<std::vector<AppliedSubspace>> result = ApplyAcceleration(&rig, &compiler, flags.acceleration);
    if (!result.ok()) return result.status();
    applied = std::move(*result);
  }
  const std::vector<std::size_t> shown = ShownMeshes(rig.scene);
  Request request = ShownPoints(rig);
  Verdicts verdicts(applied);
  verdicts.Ask(rig, &request);
  std::optional<SkinRecord> skins;
  KPSA_RETURN_IF_ERROR(MakeSkinRecord(flags, rig, shown, times->size(), &skins));
  if (skins.has_value()) skins->Ask(&request);
  const auto plan = CompileFor(rig, &compiler, request);
  if (!plan.ok()) return plan.status();

  const InterruptScope interruptible;
  Result<std::unique_ptr<VertexOutput>> output =
      CreateVertexOutput(*flags.output, rig, *times,
                         {flags.force, flags.blender, skins.has_value() ? &*skins : nullptr, flags.skinned});
  if (!output.ok()) return output.status();
  std::vector<ConstPointsView> meshes(shown.size());
  RigFrameOptions options;
  options.threads = *threads;
  Progress progress("frames", times->size(), flags.quiet);
  options.watch = progress.watch();
  KPSA_RETURN_IF_ERROR(
      EvaluateTimes(rig, *plan, *times, options, [&](std::size_t frame, const Evaluator& evaluator) {
        if (!applied.empty()) verdicts.Add(FrameNumber((*times)[frame], rig.fps), evaluator);
        if (skins.has_value()) skins->Add(evaluator);
        for (Index m = 0; m < meshes.size(); ++m) {
          meshes[m] = evaluator.Points(m);
          KPSA_RETURN_IF_ERROR(CheckFinite(rig, rig.scene.meshes[shown[m]], meshes[m], (*times)[frame]));
        }
        return (*output)->Frame(meshes);
      }));
  progress.Clear();
  if (Interrupted()) return InterruptedStatus();
  const Result<std::vector<std::string>> notes = (*output)->Finish();
  if (!notes.ok()) return notes.status();

  std::size_t vertices = 0;
  for (const std::size_t m : shown) vertices += rig.scene.meshes[m].vertex_count;
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  if (flags.json) {
    nlohmann::ordered_json document = nlohmann::ordered_json{{"schema", "kpsa.eval/1"},
                                                             {"outputs", (*output)->paths()},
                                                             {"clip", rig.scene.clip.value_or("")},
                                                             {"frames", times->size()},
                                                             {"meshes", shown.size()},
                                                             {"vertices", vertices},
                                                             {"seconds", seconds},
                                                             {"notes", *notes}};
    if (!applied.empty()) {
      nlohmann::ordered_json per_frame = nlohmann::ordered_json::array();
      for (const FrameRecord& record : verdicts.records()) {
        nlohmann::ordered_json row = {{"frame", record.frame}};
        row.update(DecisionJson<nlohmann::ordered_json>(record.decision));
        per_frame.push_back(std::move(row));
      }
      document["accelerated"] = {{"hits", verdicts.hits()},
                                 {"blends", verdicts.count(FrameVerdict::kBlend)},
                                 {"misses", verdicts.count(FrameVerdict::kMiss)},
                                 {"hit_rate", verdicts.hit_rate()},
                                 {"worst_score", verdicts.worst_score()},
                                 {"most_frequent_reason", verdicts.MostFrequentReason()},
                                 {"per_frame", std::move(per_frame)}};
    }
    PrintJson(document);
  }
  if (!flags.quiet) {
    for (const AppliedSubspace& one : applied) {
      for (const std::string& note : one.notes) Say("note: " + note);
    }
    for (const std::string& note : *notes) Say("note: " + note);
    if (!applied.empty()) Say(VerdictsText(verdicts));
    if (const std::string reason = verdicts.MostFrequentReason(); !reason.empty()) Say(reason);
    const std::vector<std::string> paths = (*output)->paths();
    Say(fmt::format("{}{}: {} of {}, {:.2f} s", paths.front(),
                    paths.size() > 1 ? fmt::format(" and {} more", paths.size() - 1) : "",
                    Plural(times->size(), "frame"), Plural(vertices, "vertex"), seconds));
  }
  return 0;
}

}  // namespace

void AddEvalCommand(CLI::App* program, Command* chosen) {
  auto flags = std::make_shared<EvalFlags>();
  CLI::App* command =
      AddCommand(program, "eval", "Evaluate a rig or a character to a vertex cache",
                 "Every frame of the first clip where neither --frames nor --times is given. Exact, unless "
                 "--accelerate or --kpsa is.\n"
                 "Examples:\n"
                 "  kpsa eval head.glb --clip face_talk -o talk.npz\n"
                 "  kpsa eval head.yaml --frames 0:48:2 --set jaw.rotateX=-20 -o open.pc2 --blender\n"
                 "  kpsa eval head.yaml --accelerate -o fast.npz\n"
                 "  kpsa eval body.yaml --clip walk -o walk.glb --skinned\n"
                 "  kpsa eval head.glb --times 0.5,1.25 -o - | python3 read.py",
                 chosen, [flags] { return Eval(*flags); });
  AddRigFlags(command, flags.get());
  AddTimeFlags(command, flags.get());
  AddOutputFlags(command, flags.get(),
                 "the vertex cache: .npz .pc2 .mdd .glb .usda, or - for .npz to stdout");
  AddSwitch(command, "--blender", &flags->blender,
            ".pc2 and .mdd for Blender's Mesh Cache: its axes and vertex order");
  AddSwitch(command, "--skinned", &flags->skinned,
            ".glb: refuse a mesh that joints and the rig's own morph targets do not move alone");
  AddSwitch(command, "--no-skinned", &flags->no_skinned,
            ".glb: write all meshes as morph targets, none with joints");
  AddAccelerationFlags(command, &flags->acceleration);
  AddThreadsFlag(command, flags.get());
  AddQuietFlag(command, flags.get());
  AddJsonFlag(command, flags.get());
}

}  // namespace kpsa::engine
