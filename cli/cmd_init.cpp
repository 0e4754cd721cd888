// kpsa init: a starter rig for a character.
#include <filesystem>
#include <memory>

#include "cli/common.h"
#include "cli/frames_range.h"
#include "cli/options.h"
#include "cli/output.h"
#include "files/file.h"
#include "files/trusted_folders.h"
#include "gltf/document_files.h"
#include "rig/build/writer.h"

namespace kpsa::engine {
namespace {

namespace fs = std::filesystem;

struct InitFlags : Flags {
  std::optional<std::string> iterations, samples;
};

// How a rig at `place` is to name its character, relative to itself; and what is to be copied there, from and to, where
// rigs there may not name the character where it is.
struct CharacterPlace {
  std::string named;
  std::vector<std::pair<fs::path, fs::path>> copies;
};

Result<CharacterPlace> PlaceCharacter(const std::string& file, const std::string& place) {
  std::error_code error;
  const fs::path folder = place == "-" ? fs::path() : fs::path(place).parent_path();
  const fs::path relative = fs::relative(file, folder.empty() ? fs::path(".") : folder, error);
  const std::string named = error || relative.empty() ? file : relative.string();
  const Result<TrustedFolders> trusted = TrustedFolders::OfRig(place == "-" ? "" : place, {});
  if (!trusted.ok()) return trusted.status();
  if (place == "-" || trusted->Hold((folder / named).string())) return CharacterPlace{named, {}};
  const fs::path name = fs::path(file).filename();
  const Result<std::vector<std::string>> beside = gltf::FilesBeside(file);
  if (!beside.ok()) return beside.status();
  CharacterPlace copied{name.string(), {{file, folder / name}}};
  for (const std::string& other : *beside) {
    const fs::path from = fs::path(file).parent_path() / other;
    if (fs::exists(from, error)) copied.copies.emplace_back(from, folder / other);  // an image may be missing
  }
  return copied;
}

// Unless the same is there already.
Status CopyFile(const fs::path& from, const fs::path& to, bool force) {
  constexpr std::uint64_t kMostBytes = std::uint64_t{4} << 30;
  const Result<std::vector<std::uint8_t>> bytes = ReadFileBytes(from.string(), kMostBytes);
  if (!bytes.ok()) return bytes.status();
  if (const auto there = ReadFileBytes(to.string(), kMostBytes); there.ok() && *there == *bytes)
    return Status();
  std::error_code error;
  fs::create_directories(to.parent_path(), error);  // without one, the next line says why
  KPSA_RETURN_IF_ERROR(CheckOutput(to.string(), force, {}));
  return WriteFileAtomically(to.string(), force, *bytes);
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
  const Result<CharacterPlace> character = PlaceCharacter(flags.file, place);
  if (!character.ok()) return character.status();
  options.character = character->named;
  options.subspace = (place == "-" ? stem : fs::path(place).stem().string()) + ".kpsa";
  NodeRegistry registry;
  AddAllNodes(registry);
  std::string remark;
  const Result<std::string> text = StarterRig(registry, flags.file, options, &remark);
  if (!text.ok()) return text.status();
  for (const auto& [from, to] : character->copies) KPSA_RETURN_IF_ERROR(CopyFile(from, to, flags.force));
  KPSA_RETURN_IF_ERROR(WriteText(place, flags.force, *text));
  if (!flags.quiet && !character->copies.empty())
    Say(fmt::format("{}: a copy of {}, since rigs name files of their own folder",
                    character->copies.front().second.string(), flags.file));
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
      "followed by a deltaMush. IK, a cage about the jaw and dual quaternions are suggested in comments. "
      "A character that the rig may not name where it is (kpsa help eval: --trust) is copied beside the "
      "rig.\n"
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
