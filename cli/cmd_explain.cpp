// kpsa explain: why a node was evaluated, and why it could not be masked or skipped; what moves a vertex;
// what SoftCache decided.
#include <algorithm>
#include <memory>

#include "base/text.h"
#include "cli/acceleration.h"
#include "cli/frames_range.h"
#include "cli/interrupt.h"
#include "cli/options.h"
#include "cli/request.h"
#include "graph/evaluator.h"
#include "host/explain/decision_story.h"
#include "host/explain/node_story.h"
#include "host/explain/vertex_story.h"
#include "host/rig_frames.h"
#include "report/decision_text.h"
#include "report/node_text.h"
#include "report/vertex_text.h"

namespace kpsa::engine {
namespace {

struct ExplainFlags : Flags {
  AccelerationFlags acceleration;
  std::optional<std::string> node;
  std::string what;  // the same
  std::vector<std::string> wanted;
  std::optional<std::string> vertices, frame;
};

constexpr int kMostFrames = 1'000'000;  // of --frame

struct Target {
  NodeId node;
  std::string attribute;  // text about it, "" where only a node was named
};

Result<Target> FindTarget(const Rig& rig, const std::string& what) {
  if (const Result<NodeId> node = rig.graph->FindNode(what); node.ok()) return Target{*node, ""};
  const Result<PlugRef> plug = rig.graph->FindPlug(what);
  if (plug.ok())
    return Target{plug->node, fmt::format("{} is {}", rig.graph->PlugName(*plug), SourceOfValue(rig, *plug))};
  // Without a dot it was meant as a node, and with one as well where a node is nearly called so
  std::vector<std::string> names;
  for (const NodeId node : rig.graph->Nodes()) names.push_back(rig.graph->name(node));
  const bool of_node = LongestBefore('.', what, [&](std::string_view name) {
                         return rig.graph->FindNode(name).ok();
                       }) != std::string::npos;
  const bool as_node = what.find('.') == std::string::npos || (!of_node && !DidYouMean(what, names).empty());
  return AsUsage(as_node ? rig.graph->FindNode(what).status() : plug.status());
}

CommandResult ExplainDecisions(const ExplainFlags& flags, Rig* rig, int frame) {
  const Result<DecisionStory> story =
      TellOfDecisions(rig, ChoiceOf(flags.acceleration), frame, InterruptWatch());
  if (!story.ok()) return story.status();
  Print(flags.json ? DecisionStoryJson(*story) : DecisionText(*story));
  return 0;
}

CommandResult ExplainVertex(const ExplainFlags& flags, const OpenRig& open, const VertexName& vertex) {
  const Rig& rig = open.rig;
  if (flags.acceleration.wanted() || !flags.wanted.empty() || flags.vertices.has_value())
    return Status::Usage(
        "{}: a vertex is told of with its full stack: expected no --accelerate, --kpsa, --want or "
        "--vertices",
        flags.what);
  const Result<std::vector<double>> times = SampleTimes(flags, open);
  if (!times.ok()) return times.status();
  if (times->size() != 1 && (flags.frames.has_value() || flags.times.has_value()))
    return Status::Usage("{}: expected one frame, found {}", flags.what, Thousands(times->size()));
  Flags rest_flags = flags;
  rest_flags.rest = true;
  rest_flags.clip.reset();
  rest_flags.pose.reset();
  rest_flags.sets.clear();
  const Result<std::unique_ptr<OpenRig>> rest = LoadRigOf(rest_flags);
  if (!rest.ok()) return rest.status();
  const Result<VertexStory> story = TellOfVertex(rig, (*rest)->rig, vertex, times->front());
  if (!story.ok()) return story.status();
  Print(flags.json ? VertexJson(*story) : VertexText(*story));
  return 0;
}

CommandResult Explain(ExplainFlags flags) {
  std::optional<int> frame;
  if (flags.frame.has_value()) {
    if (flags.frames.has_value() || flags.times.has_value())
      return Status::Usage("--frame and {}: expected one of them",
                           flags.frames.has_value() ? "--frames" : "--times");
    const Result<int> number = ParseCount("--frame", *flags.frame, -kMostFrames, kMostFrames);
    if (!number.ok()) return number.status();
    frame = *number;
    flags.frames = *flags.frame;
  }
  KPSA_RETURN_IF_ERROR(CheckTimeFlags(flags));
  KPSA_RETURN_IF_ERROR(CheckAccelerationFlags(flags.acceleration, flags.acceleration.wanted()));
  const bool decisions = !flags.node.has_value();
  if (decisions && !(flags.acceleration.wanted() && frame.has_value()))
    return Status::Usage(
        "expected NODE, or --accelerate (or --kpsa) and --frame F for what SoftCache decided");
  if (decisions && (!flags.wanted.empty() || flags.vertices.has_value()))
    return Status::Usage("{} is of no use without NODE", flags.wanted.empty() ? "--vertices" : "--want");
  flags.what = flags.node.value_or("");
  const Result<std::unique_ptr<OpenRig>> open = LoadRigOf(flags);
  if (!open.ok()) return open.status();
  Rig& rig = (*open)->rig;
  if (decisions) return ExplainDecisions(flags, &rig, *frame);
  if (!rig.graph->FindNode(flags.what).ok() && !rig.graph->FindPlug(flags.what).ok()) {
    const Result<std::optional<VertexName>> vertex = FindVertex(rig, flags.what);
    if (!vertex.ok()) return vertex.status();
    if (vertex->has_value()) return ExplainVertex(flags, **open, **vertex);
  }
  Compiler compiler;
  const Result<Request> request =
      AcceleratedRequest(&rig, &compiler, flags.acceleration, flags.wanted, flags.vertices);
  if (!request.ok()) return request.status();
  const Result<Target> target = FindTarget(rig, flags.what);
  if (!target.ok()) return target.status();
  const auto compiled = CompileFor(rig, &compiler, *request);
  if (!compiled.ok()) return compiled.status();
  const Plan& plan = **compiled;
  const Result<std::vector<double>> times = SampleTimes(flags, **open);
  if (!times.ok()) return times.status();
  const InterruptScope interruptible;
  Profile profile(plan);
  if (frame.has_value()) {
    Evaluator evaluator(*compiled);
    KPSA_RETURN_IF_ERROR(EvaluateTo(rig, *frame, &evaluator, InterruptWatch(), &profile));
  } else {
    RigFrameOptions options;
    options.threads = 1;
    options.watch = InterruptWatch();
    options.profile = &profile;
    KPSA_RETURN_IF_ERROR(EvaluateTimes(rig, *compiled, *times, options,
                                       [](std::size_t, const Evaluator&) { return Status(); }));
  }

  const NodeStory story = TellOfNode(rig, plan, profile, target->node, target->attribute, times->size());
  Print(flags.json ? NodeStoryJson(story) : NodeStoryText(story));
  return 0;
}

}  // namespace

void AddExplainCommand(CLI::App* program, Command* chosen) {
  auto flags = std::make_shared<ExplainFlags>();
  CLI::App* command = AddCommand(
      program, "explain", "Why a node is evaluated or not, what moves a vertex, why a frame is a hit or not",
      "Of a node: what dirtied it, who needs it, why it is not masked or skipped. Evaluates the "
      "clip, or the frames "
      "that are chosen, and tells of the last evaluation; --frame tells what changed since the "
      "frame before.\n"
      "Of a vertex: the joints, morph targets and deformers that move it, and how far.\n"
      "Of no node, with a subspace and --frame: what SoftCache decided there, and why.\n"
      "Examples:\n"
      "  kpsa explain head.yaml mush\n"
      "  kpsa explain head.yaml jaw.rotateX --clip face_talk\n"
      "  kpsa explain head.yaml mush --accelerate --frame 12\n"
      "  kpsa explain head.yaml --accelerate --frame 12\n"
      "  kpsa explain head.yaml head_mesh[812] --frame 12",
      chosen, [flags] { return Explain(*flags); });
  AddRigFlags(command, flags.get());
  AddOption(
      command, "NODE", "", &flags->node,
      "a node, a plug (node.attr) or a vertex (mesh[812]); without it, what SoftCache decided at --frame");
  AddTimeFlags(command, flags.get());
  AddOption(command, "--frame", "F", &flags->frame, "one frame, after the one before it");
  AddRepeated(command, "--want", "PLUG", &flags->wanted,
              "a plug or a mesh's points (head_mesh@mush) instead of all visible meshes; may be repeated");
  AddOption(command, "--vertices", "LIST", &flags->vertices,
            "only some vertices of the wanted meshes, as in 0:99,120");
  AddAccelerationFlags(command, &flags->acceleration);
  AddJsonFlag(command, flags.get());
}

}  // namespace kpsa::engine
