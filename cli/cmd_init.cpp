// kpsa init: a starter rig for a character.
#include <filesystem>
#include <memory>

#include "cli/common.h"
#include "cli/frames_range.h"
#include "cli/options.h"
#include "cli/output.h"
#include "files/trusted_folders.h"
#include "rig/build/writer.h"

namespace kpsa::engine {
namespace {

namespace fs = std::filesystem;

struct InitFlags : Flags {
  std::optional<std::string> iterations, samples;
};

// How a rig at `place` names its character: relative to itself, where rigs there may name it so; else by its whole path.
Result<std::string> CharacterOf(const std::string& file, const std::string& place) {
  std::error_code error;
  const std::string rig = place == "-" ? "" : place;
  const fs::path folder = fs::path(rig).parent_path();
  const fs::path relative = fs::relative(file, folder.empty() ? fs::path(".") : folder, error);
  const std::string named = error || relative.empty() ? file : relative.string();
  const Result<TrustedFolders> trusted = TrustedFolders::OfRig(rig, {});
  if (!trusted.ok()) return trusted.status();
  return trusted->Hold((folder / named).string()) ? named
                                                  : fs::absolute(file, error).lexically_normal().string();
}

CommandResult Init(const InitFlags& flags) {
  StarterOptions options;
  const Result<int> iterations = ParseCount("--iterations", flags.iterations.value_or("10"), 0, 200);
  if (!iterations.ok()) return iterations.status();
  options.iterations = *iterations;
  if (flags.samples.has_value()) {
    const Result<int> samples = ParseCount("--samples", *flags.samples, 0, 1'000'000);
    if (!samples.ok()) return samples.status();
    options.samples = *samples;
  }
  const std::string suffix = FileSuffix(flags.file);
  if (suffix != ".glb" && suffix != ".gltf" && suffix != ".vrm")
    return Status::Usage("expected a character, .glb, .gltf or .vrm").At({flags.file});
  const std::string stem = fs::path(flags.file).stem().string();
  const std::string place = flags.output.value_or(stem + ".yaml");
  KPSA_RETURN_IF_ERROR(CheckOutput(place, flags.force, {".yaml", ".yml"}));
  const Result<std::string> character = CharacterOf(flags.file, place);
  if (!character.ok()) return character.status();
  options.character = *character;
  options.subspace = (place == "-" ? stem : fs::path(place).stem().string()) + ".kpsa";
  NodeRegistry registry;
  AddAllNodes(registry);
  std::string remark;
  const Result<std::string> text = StarterRig(registry, flags.file, options, &remark);
  if (!text.ok()) return text.status();
  KPSA_RETURN_IF_ERROR(WriteText(place, flags.force, *text));
  if (!flags.quiet && !remark.empty()) Say(fmt::format("note: {}: {}", flags.file, remark));
  if (!flags.quiet && place != "-")
    Say(fmt::format("{}: a starter rig; read it, it says what to change\nnext: kpsa {} {}", place,
                    text->find("\naccelerate:") != std::string::npos ? "train" : "eval", place));
  return 0;
}

}  // namespace

void AddInitCommand(CLI::App* program, Command* chosen) {
  auto flags = std::make_shared<InitFlags>();
  CLI::App* command = AddCommand(
      program, "init", "Write a starter rig for a character",
      "Controls are ranged by the character's clips and grouped by part of the body; its own deformers are "
      "followed by a deltaMush. IK, a cage about the jaw and dual quaternions are suggested in comments.\n"
      "Examples:\n"
      "  kpsa init head.glb\n"
      "  kpsa init characters/head.glb -o rigs/head.yaml",
      chosen, [flags] { return Init(*flags); });
  AddRequired(command, "CHARACTER", &flags->file, "a character, .glb, .gltf or .vrm");
  AddOutputFlags(command, flags.get(),
                 "the rig; the character's name with .yaml, in this folder, if not given");
  AddOption(command, "--iterations", "N", &flags->iterations, "of the deltaMush; 10 if not given");
  AddOption(command, "--samples", "N", &flags->samples,
            "training poses drawn from the controls; by the number of controls if not given");
  AddQuietFlag(command, flags.get());
}

}  // namespace kpsa::engine
