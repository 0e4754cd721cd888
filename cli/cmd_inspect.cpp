// kpsa inspect: what is in a file.
#include <memory>

#include "cli/command.h"
#include "cli/common.h"
#include "cli/frames_range.h"
#include "cli/options.h"
#include "files/suffix.h"
#include "report/character_facts.h"

namespace kpsa::engine {
namespace {

struct InspectFlags : Flags {
  std::optional<std::string> nearest, vertices_of;
};

// A rig is loaded, with its plugins; so is a character that is asked for its vertices.
Result<FileFacts> FactsOf(const InspectFlags& flags, double fps) {
  const bool of_vertices = flags.nearest.has_value() || flags.vertices_of.has_value();
  const std::string suffix = FileSuffix(flags.file);
  const bool character = suffix == ".glb" || suffix == ".gltf" || suffix == ".vrm";
  if (suffix != ".yaml" && suffix != ".yml") {
    if (!of_vertices) return InspectFile(flags.file, fps);
    if (!character)
      return Status::Usage("{} is of a rig or a character", flags.nearest ? "--nearest" : "--vertices-of")
          .At({flags.file});
  }
  Double3 place;
  if (flags.nearest.has_value()) {
    const Result<Double3> read = ParsePlace("--nearest", *flags.nearest);
    if (!read.ok()) return read.status();
    place = *read;
  }
  Flags rig;
  rig.file = flags.file;
  rig.plugins = flags.plugins;
  rig.trust = flags.trust;
  rig.reads_only = flags.reads_only, rig.rig_plugins = flags.rig_plugins;
  rig.rest = character;
  const Result<std::unique_ptr<OpenRig>> open = LoadRigOf(rig);
  if (!open.ok()) return open.status();
  if (flags.nearest.has_value()) return NearestFacts((*open)->rig, place);
  if (flags.vertices_of.has_value()) return VerticesFacts((*open)->rig, *flags.vertices_of);
  return RigFacts((*open)->rig);
}

CommandResult Inspect(const InspectFlags& flags) {
  if (flags.nearest.has_value() && flags.vertices_of.has_value())
    return Status::Usage("--nearest and --vertices-of: expected one of them");
  double fps = 24;
  if (flags.fps.has_value()) {
    const Result<double> parsed = ParseNumber("--fps", *flags.fps);
    if (!parsed.ok()) return parsed.status();
    if (!(*parsed > 0)) return Status::Usage("--fps {}: expected a number above 0", *flags.fps);
    fps = *parsed;
  }
  const Result<FileFacts> facts = FactsOf(flags, fps);
  if (!facts.ok()) return facts.status();
  Print(flags.json ? FactsJson(flags.file, *facts) : FactsText(flags.file, *facts));
  return 0;
}

}  // namespace

void AddInspectCommand(CLI::App* program, Command* chosen) {
  auto flags = std::make_shared<InspectFlags>();
  CLI::App* command = AddCommand(program, "inspect", "What is in any file that kpsa reads or writes",
                                 "Examples:\n"
                                 "  kpsa inspect head.glb\n"
                                 "  kpsa inspect head.glb --nearest 0,1.65,0.1\n"
                                 "  kpsa inspect head.glb --vertices-of jaw\n"
                                 "  kpsa inspect head.kpsa --json",
                                 chosen, [flags] { return Inspect(*flags); });
  AddRequired(command, "FILE", &flags->file,
              ".glb .gltf .vrm .yaml .npz .obj .pc2 .mdd .kpsa, or .json (weight maps)");
  AddOption(command, "--fps", "N", &flags->fps,
            "frames a second of .pc2 files and of a character's clips; 24 if not given");
  AddOption(command, "--nearest", "X,Y,Z", &flags->nearest,
            "the vertex that is nearest to a place of the rest pose, metres, before the rig's own deformers");
  AddOption(
      command, "--vertices-of", "NAME", &flags->vertices_of,
      "the vertices that a joint moves or a material covers (or all of a mesh), as rig files list them");
  AddPluginFlags(command, flags.get(), NativeCode::kWhereToldTo);
  AddJsonFlag(command, flags.get());
}

}  // namespace kpsa::engine
