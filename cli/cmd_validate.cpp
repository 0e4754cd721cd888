// kpsa validate: every error of a rig or a character.
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/command.h"
#include "cli/common.h"
#include "cli/options.h"
#include "host/finite_points.h"
#include "host/rig_frames.h"
#include "host/rig_training.h"

namespace kpsa::engine {
namespace {

// Loads, compiles and evaluates one frame; what is left to say of a sound rig goes to `notes`.
Status Check(const Flags& flags, std::vector<std::string>* notes, std::string* summary) {
  const Result<std::unique_ptr<OpenRig>> open = LoadRigOf(flags);
  if (!open.ok()) return open.status();
  const Rig& rig = (*open)->rig;
  *notes = rig.character->warnings;
  notes->insert(notes->end(), rig.notes.begin(), rig.notes.end());
  Compiler compiler;
  Request request;
  for (const CharacterMesh& mesh : rig.scene.meshes) request.outputs.push_back({mesh.points, {}});
  request.varying = VaryingPlugs(rig);
  const auto plan = CompileFor(rig, &compiler, request);
  if (!plan.ok()) return plan.status();
  KPSA_RETURN_IF_ERROR(EvaluateTimes(rig, *plan, {0.0}, {}, [&](std::size_t, const Evaluator& evaluator) {
    for (std::size_t m = 0; m < rig.scene.meshes.size(); ++m)
      KPSA_RETURN_IF_ERROR(CheckFinite(rig, rig.scene.meshes[m], evaluator.Points(m), 0));
    return Status();
  }));
  std::size_t vertices = 0;
  for (const CharacterMesh& mesh : rig.scene.meshes) vertices += mesh.vertex_count;
  *summary =
      fmt::format("{}: fine: {}, {} of {}, {}, {}", flags.file, Plural(rig.graph->Nodes().size(), "node"),
                  Plural(rig.scene.meshes.size(), "mesh"), Plural(vertices, "vertex"),
                  Plural(rig.scene.clips.size(), "clip"), Plural(rig.controls.size(), "control"));
  return Status();
}

CommandResult Validate(const Flags& flags) {
  std::vector<std::string> notes;
  std::string summary;
  const Status status = Check(flags, &notes, &summary);
  if (flags.json) {
    nlohmann::ordered_json errors = nlohmann::ordered_json::array();
    for (const Error& error : status.errors()) {
      errors.push_back({{"file", error.where.file},
                        {"line", error.where.line},
                        {"column", error.where.column},
                        {"message", error.message}});
    }
    PrintJson(nlohmann::ordered_json{{"schema", "kpsa.validate/1"},
                                     {"file", flags.file},
                                     {"valid", status.ok()},
                                     {"errors", std::move(errors)},
                                     {"notes", notes}});
    return ExitCode(status);
  }
  if (!status.ok()) {
    PrintErrors("kpsa validate", status, 10'000);
    if (status.errors().size() > 1) Say(Plural(status.errors().size(), "error"));
    return ExitCode(status);
  }
  if (!flags.quiet) {
    for (const std::string& note : notes) Say("note: " + note);
    Print(summary + "\n");
  }
  return 0;
}

}  // namespace

void AddValidateCommand(CLI::App* program, Command* chosen) {
  auto flags = std::make_shared<Flags>();
  CLI::App* command =
      AddCommand(program, "validate", "Every error of a rig or a character, with place and suggestion",
                 "Loads the file with all that it names, compiles it and evaluates its first frame. Exit 3 "
                 "where something is wrong, 4 where that frame fails or is not finite.\n"
                 "Examples:\n"
                 "  kpsa validate head.yaml\n"
                 "  kpsa validate head.glb --json",
                 chosen, [flags] { return Validate(*flags); });
  AddRigFlags(command, flags.get(), NativeCode::kWhereToldTo);
  AddQuietFlag(command, flags.get());
  AddJsonFlag(command, flags.get());
}

}  // namespace kpsa::engine
