// kpsa pose: a pose of a rig as a file.
#include <memory>

#include "cli/command.h"
#include "cli/common.h"
#include "cli/frames_range.h"
#include "cli/options.h"
#include "cli/output.h"
#include "host/pose_text.h"

namespace kpsa::engine {
namespace {

struct PoseFlags : Flags {
  std::optional<std::string> time;
  bool all = false;
};

CommandResult WritePose(const PoseFlags& flags) {
  const std::string place = flags.output.value_or("-");
  KPSA_RETURN_IF_ERROR(CheckOutput(place, flags.force, {".yaml", ".yml"}));
  PoseTextOptions options;
  options.all = flags.all;
  if (flags.time.has_value()) {
    const Result<double> time = ParseNumber("--time", *flags.time);
    if (!time.ok()) return time.status();
    options.time = *time;
  }
  const Result<std::unique_ptr<OpenRig>> open = LoadRigOf(flags);
  if (!open.ok()) return open.status();
  const Rig& rig = (*open)->rig;
  KPSA_RETURN_IF_ERROR(CheckNotInput(place, rig.files));
  if (flags.clip.has_value()) options.clip = *flags.clip;
  if (flags.rest) options.clip = "";
  if ((*open)->pose_time.has_value()) {  // of the pose that is changed
    options.clip = rig.scene.clip.value_or("");
    if (!flags.time.has_value()) options.time = *(*open)->pose_time;
  }
  if (flags.time.has_value() && options.clip.value_or("").empty())
    return Status::Usage("--time is of no use without --clip");
  const Result<std::string> text = PoseText(rig, options);
  if (!text.ok()) return text.status();
  KPSA_RETURN_IF_ERROR(WriteText(place, flags.force, *text));
  return 0;
}

}  // namespace

void AddPoseCommand(CLI::App* program, Command* chosen) {
  auto flags = std::make_shared<PoseFlags>();
  CLI::App* command =
      AddCommand(program, "pose", "Write a pose file, which --pose reads",
                 "What is set and differs from rest, in the rig's units, and the clip that it "
                 "is over where one is named.\n"
                 "Examples:\n"
                 "  kpsa pose head.yaml --set jaw.rotateX=-20 -o open.yaml\n"
                 "  kpsa pose head.yaml --pose open.yaml --set jaw.rotateX=-10 -o less.yaml\n"
                 "  kpsa pose head.yaml --clip face_talk --time 1.25 --all -o talk.yaml\n"
                 "  kpsa render head.yaml --pose talk.yaml -o talk.png",
                 chosen, [flags] { return WritePose(*flags); });
  AddRigFlags(command, flags.get());
  AddOption(command, "--time", "T", &flags->time, "when in the clip, seconds; 0 if not given");
  AddSwitch(command, "--all", &flags->all, "every control, as it is then, also at rest");
  AddOutputFlags(command, flags.get(), "a .yaml file instead of stdout");
}

}  // namespace kpsa::engine
