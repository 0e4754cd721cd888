// kpsa graph: the rig as a drawing, for Graphviz.
#include <memory>

#include "cli/acceleration.h"
#include "cli/frames_range.h"
#include "cli/interrupt.h"
#include "cli/options.h"
#include "cli/output.h"
#include "cli/request.h"
#include "graph/dot.h"
#include "host/graph_part.h"
#include "host/rig_frames.h"

namespace kpsa::engine {
namespace {

struct GraphFlags : Flags {
  AccelerationFlags acceleration;
  std::vector<std::string> wanted;
  std::optional<std::string> vertices, hide, around;
  bool time = false, all = false;
};

CommandResult DrawGraph(const GraphFlags& flags) {
  const std::string place = flags.output.value_or("-");
  KPSA_RETURN_IF_ERROR(CheckAccelerationFlags(flags.acceleration, flags.acceleration.wanted()));
  KPSA_RETURN_IF_ERROR(CheckTimeFlags(flags));
  KPSA_RETURN_IF_ERROR(CheckOutput(place, flags.force, {".dot", ".gv"}));
  const Result<std::unique_ptr<OpenRig>> open = LoadRigOf(flags);
  if (!open.ok()) return open.status();
  Rig& rig = (*open)->rig;
  const GraphPart part{SplitNames(flags.hide.value_or("")), flags.around};
  KPSA_RETURN_IF_ERROR(AsUsage(HiddenNodes(rig, part).status()));
  Compiler compiler;
  const Result<Request> request =
      AcceleratedRequest(&rig, &compiler, flags.acceleration, flags.wanted, flags.vertices);
  if (!request.ok()) return request.status();
  const auto plan = CompileFor(rig, &compiler, *request);
  if (!plan.ok()) return plan.status();
  const InterruptScope interruptible;
  Profile profile(**plan);
  std::size_t frames = 1;
  if (flags.time) {
    const Result<std::vector<double>> times = SampleTimes(flags, **open);
    if (!times.ok()) return times.status();
    frames = times->size();
    RigFrameOptions options;
    options.threads = 1;
    options.watch = InterruptWatch();
    options.profile = &profile;
    KPSA_RETURN_IF_ERROR(
        EvaluateTimes(rig, *plan, *times, options, [](std::size_t, const Evaluator&) { return Status(); }));
  }
  // A node may have been put in for a subspace, and one that is left out has neighbours, too
  const Result<std::vector<bool>> hidden = HiddenNodes(rig, part);
  if (!hidden.ok()) return AsUsage(hidden.status());
  const DotOptions options{flags.time ? &profile : nullptr, frames, flags.all || flags.around.has_value(),
                           *hidden};
  KPSA_RETURN_IF_ERROR(WriteText(place, flags.force, DrawDot(*rig.graph, **plan, options)));
  return 0;
}

}  // namespace

void AddGraphCommand(CLI::App* program, Command* chosen) {
  auto flags = std::make_shared<GraphFlags>();
  CLI::App* command =
      AddCommand(program, "graph", "The rig as a Graphviz drawing, coloured by what is kept or by time",
                 "Green: evaluated always; yellow: only on demand; grey (--all): left out. With --time: red "
                 "is where the time goes.\n"
                 "Examples:\n"
                 "  kpsa graph head.yaml | dot -Tsvg > head.svg\n"
                 "  kpsa graph head.yaml --time --clip face_talk -o head.dot\n"
                 "  kpsa graph head.yaml --accelerate --all -o head.dot\n"
                 "  kpsa graph head.yaml --around jaw:2 --hide clips -o jaw.dot",
                 chosen, [flags] { return DrawGraph(*flags); });
  AddRigFlags(command, flags.get());
  AddTimeFlags(command, flags.get());
  AddOutputFlags(command, flags.get(), "a .dot file instead of stdout");
  AddAccelerationFlags(command, &flags->acceleration);
  AddRepeated(command, "--want", "PLUG", &flags->wanted,
              "a plug or a mesh's points (head_mesh@mush) instead of all visible meshes; may be repeated");
  AddOption(command, "--vertices", "LIST", &flags->vertices,
            "only some vertices of the wanted meshes, as in 0:99,120");
  AddSwitch(command, "--time", &flags->time, "evaluate the clip and colour by time");
  AddSwitch(command, "--all", &flags->all, "draw the nodes that are left out, too");
  AddOption(command, "--hide", "KIND,...", &flags->hide,
            "leave out joints, transforms, clips, or nodes of a type (unitConversion)");
  AddOption(command, "--around", "NODE[:N]", &flags->around,
            "only what is within N connections of a node, 1 if not given; nodes that are left out, too");
}

}  // namespace kpsa::engine
