// kpsa fmt: rig files in their canonical form.
#include <memory>

#include "cli/command.h"
#include "cli/common.h"
#include "cli/options.h"
#include "cli/output.h"
#include "files/file.h"
#include "rig/file/format.h"

namespace kpsa::engine {
namespace {

struct FmtFlags : Flags {
  std::vector<std::string> files;
  bool check = false, in_place = false, drop_comments = false;
};

// All that kpsa validate says of a rig; of a part that others include, what can be said of it alone.
Status CheckRig(const std::string& file, const YamlNode& root, const FmtFlags& flags) {
  if (root.Find("character") == nullptr && root.Find("references") == nullptr) {
    const Result<TrustedFolders> trusted = TrustedFolders::OfRig(file, flags.trust, "--trust");
    if (!trusted.ok()) return trusted.status();
    RigFile part;
    return ReadRigFile(file, std::nullopt, &part, true, &*trusted);
  }
  Flags rig = flags;
  rig.file = file;
  rig.output.reset();
  return LoadRigOf(rig).status();
}

// The file's text and its canonical form.
struct Formatted {
  std::string before, after;
  bool loses_comments = false;  // they could not be told from what the file says
};
Result<Formatted> Format(const std::string& file, const FmtFlags& flags) {
  const std::string suffix = FileSuffix(file);
  if (suffix != ".yaml" && suffix != ".yml")
    return Status::Usage("expected a rig file that ends in .yaml").At({file});
  Result<std::vector<std::uint8_t>> bytes = ReadFileBytes(file, kMaxYamlBytes);
  if (!bytes.ok()) return bytes.status();
  Formatted text;
  text.before.assign(bytes->begin(), bytes->end());
  const Result<YamlNode> root = ParseYaml(text.before, file);
  if (!root.ok()) return root.status();
  KPSA_RETURN_IF_ERROR(CheckRig(file, *root, flags));
  NodeRegistry registry;
  AddAllNodes(registry);
  PluginLoader plugins(&registry);
  KPSA_RETURN_IF_ERROR(LoadPlugins(flags, &plugins));
  CommentMap kept;
  if (!flags.drop_comments) {
    const std::optional<std::vector<Comment>> comments = FindComments(text.before);
    text.loses_comments = !comments.has_value() && HasComments(text.before);
    if (comments.has_value()) kept = AttachComments(*root, text.before, *comments);
  }
  Result<std::string> after = FormatRig(*root, registry, kept);
  if (!after.ok()) return after.status();
  text.after = std::move(*after);
  return text;
}

CommandResult Fmt(const FmtFlags& flags) {
  if (flags.check && (flags.in_place || flags.output.has_value()))
    return Status::Usage("--check writes nothing: expected it without --in-place and -o");
  if (flags.in_place && flags.output.has_value())
    return Status::Usage("--in-place and -o {}: expected one of them", *flags.output);
  if (flags.files.size() > 1 && !flags.check && !flags.in_place)
    return Status::Usage("several files: expected --check or --in-place");
  if (flags.output.has_value()) {
    KPSA_RETURN_IF_ERROR(CheckOutput(*flags.output, flags.force, {".yaml", ".yml"}));
    KPSA_RETURN_IF_ERROR(CheckNotInput(*flags.output, flags.files));
  }
  bool differs = false;
  Status errors;
  for (const std::string& file : flags.files) {
    const Result<Formatted> text = Format(file, flags);
    if (!text.ok()) {
      errors.Append(text.status());
      continue;
    }
    const bool same = text->before == text->after;
    const bool loses = !flags.check && !same && text->loses_comments;
    if (flags.check) {
      if (!same) Print(file + "\n");
      differs = differs || !same;
    } else if (flags.in_place) {
      if (loses) {
        errors.Append(
            Status::Usage("has comments, which would be lost; --drop-comments lets them go").At({file}));
      } else if (!same) {
        errors.Append(WriteText(file, true, text->after));
      }
    } else {
      if (loses && !flags.quiet) Say(fmt::format("kpsa fmt: {}: its comments are left out", file));
      errors.Append(WriteText(flags.output.value_or("-"), flags.force, text->after));
    }
  }
  if (!errors.ok()) return errors;
  return differs ? 1 : 0;
}

}  // namespace

void AddFmtCommand(CLI::App* program, Command* chosen) {
  auto flags = std::make_shared<FmtFlags>();
  CLI::App* command = AddCommand(
      program, "fmt", "A rig file in canonical form",
      "Sections in one order, an entry a line where it fits, quotes where they are needed. Comments "
      "stay with their entries. Invalid rigs are refused.\n"
      "Examples:\n"
      "  kpsa fmt head.yaml -o tidy.yaml\n"
      "  kpsa fmt head.yaml lips.yaml --check\n"
      "  kpsa fmt head.yaml --in-place",
      chosen, [flags] { return Fmt(*flags); });
  AddRepeated(command, "FILE", "FILE", &flags->files, "rig files (.yaml)");
  AddOption(command, "-o,--output", "FILE", &flags->output, "a .yaml file instead of stdout");
  AddSwitch(command, "--force", &flags->force, "replace an existing output");
  AddSwitch(command, "--check", &flags->check,
            "write nothing: print the files that are not so; exit 1 if any");
  AddSwitch(command, "--in-place", &flags->in_place, "replace the files themselves");
  AddSwitch(command, "--drop-comments", &flags->drop_comments, "leave comments out");
  AddPluginFlags(command, flags.get(), NativeCode::kWhereToldTo);
  AddSwitch(command, "-q,--quiet", &flags->quiet, "no messages but errors");
}

}  // namespace kpsa::engine
