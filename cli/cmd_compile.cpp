// kpsa compile: what a request needs of a rig, and why.
#include <memory>

#include "cli/acceleration.h"
#include "cli/command.h"
#include "cli/common.h"
#include "cli/options.h"
#include "cli/request.h"
#include "host/rig_frames.h"
#include "host/rig_training.h"
#include "report/plan_text.h"

namespace kpsa::engine {
namespace {

struct CompileFlags : Flags {
  AccelerationFlags acceleration;
  std::vector<std::string> wanted;
  std::optional<std::string> vertices;
  bool steps = false;
};

CommandResult Compile(const CompileFlags& flags) {
  KPSA_RETURN_IF_ERROR(CheckAccelerationFlags(flags.acceleration, flags.acceleration.wanted()));
  const Result<std::unique_ptr<OpenRig>> open = LoadRigOf(flags);
  if (!open.ok()) return open.status();
  Rig& rig = (*open)->rig;
  Compiler compiler;
  Result<Request> request =
      AcceleratedRequest(&rig, &compiler, flags.acceleration, flags.wanted, flags.vertices);
  if (!request.ok()) return request.status();
  request->varying = VaryingPlugs(rig);
  const auto compiled = CompileFor(rig, &compiler, *request);
  if (!compiled.ok()) return compiled.status();
  Print(flags.json ? PlanJson(**compiled, flags.steps) : PlanText(**compiled, flags.steps));
  return 0;
}

}  // namespace

void AddCompileCommand(CLI::App* program, Command* chosen) {
  auto flags = std::make_shared<CompileFlags>();
  CLI::App* command =
      AddCommand(program, "compile", "Which nodes and how many points of each a request keeps, and why",
                 "Time and the rig's controls vary.\n"
                 "Examples:\n"
                 "  kpsa compile head.yaml\n"
                 "  kpsa compile head.yaml --want head_mesh@mush --vertices 0:9\n"
                 "  kpsa compile head.glb --want jaw.worldMatrix",
                 chosen, [flags] { return Compile(*flags); });
  AddRigFlags(command, flags.get(), NativeCode::kWhereToldTo);
  AddRepeated(command, "--want", "PLUG", &flags->wanted,
              "a plug or a mesh's points (head_mesh@mush) instead of all visible meshes; may be repeated");
  AddOption(command, "--vertices", "LIST", &flags->vertices,
            "only some vertices of the wanted meshes, as in 0:99,120");
  AddSwitch(command, "--steps", &flags->steps, "every step by itself instead of nodes");
  AddAccelerationFlags(command, &flags->acceleration);
  AddJsonFlag(command, flags.get());
}

}  // namespace kpsa::engine
