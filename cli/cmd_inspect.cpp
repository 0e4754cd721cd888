// kpsa inspect: what is in a file.
#include <memory>

#include "cli/command.h"
#include "cli/common.h"
#include "cli/frames_range.h"
#include "cli/options.h"
#include "files/suffix.h"
#include "report/file_facts.h"

namespace kpsa::engine {
namespace {

// A rig is loaded, with its plugins; --fps is of point caches.
Result<FileFacts> FactsOf(const Flags& flags, double fps) {
  const std::string suffix = FileSuffix(flags.file);
  if (suffix != ".yaml" && suffix != ".yml") return InspectFile(flags.file, fps);
  Flags rig;
  rig.file = flags.file;
  rig.plugins = flags.plugins;
  const Result<std::unique_ptr<OpenRig>> open = LoadRigOf(rig);
  if (!open.ok()) return open.status();
  return RigFacts((*open)->rig);
}

CommandResult Inspect(const Flags& flags) {
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
  auto flags = std::make_shared<Flags>();
  CLI::App* command = AddCommand(program, "inspect", "What is in any file that kpsa reads or writes",
                                 "Examples:\n"
                                 "  kpsa inspect head.glb\n"
                                 "  kpsa inspect head.kpsa --json",
                                 chosen, [flags] { return Inspect(*flags); });
  AddRequired(command, "FILE", &flags->file,
              ".glb .gltf .vrm .yaml .npz .pc2 .mdd .kpsa, or .json (weight maps)");
  AddOption(command, "--fps", "N", &flags->fps, "frames a second of .pc2 files; 24 if not given");
  AddPluginFlag(command, flags.get());
  AddJsonFlag(command, flags.get());
}

}  // namespace kpsa::engine
