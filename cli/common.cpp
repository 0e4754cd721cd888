#include "cli/common.h"

#include <cmath>
#include <cstdio>

#include "cli/frames_range.h"
#include "cli/options.h"
#include "files/quantity.h"
#include "kpsa/kpsa_node.h"
#include "nodes/standard_nodes.h"

namespace kpsa::engine {
void AddRigFlags(CLI::App* command, Flags* flags, NativeCode code) {
  AddRequired(command, "FILE", &flags->file, "a rig (.yaml) or a character (.glb, .gltf, .vrm)");
  AddPoseFlags(command, flags, true, code);
}

void AddPoseFlags(CLI::App* command, Flags* flags, bool clip, NativeCode code) {
  AddRepeated(command, "--set", "PLUG=VALUE", &flags->sets,
              "plug=value in the rig's units, as in jaw.rotateX=-20; may be repeated");
  AddOption(command, "--pose", "FILE", &flags->pose, "a pose file: plugs and their values");
  if (clip) {
    AddOption(command, "--clip", "NAME", &flags->clip,
              "a clip of the character; its first one if none is named");
  }
  AddSwitch(command, "--rest", &flags->rest, "no clip: the file's transforms and default weights");
  AddOption(command, "--fps", "N", &flags->fps, "frames a second; the rig's, else 24");
  AddOption(command, "--variant", "NAME", &flags->variant, "a variant of the rig");
  AddPluginFlags(command, flags, code);
}

void AddPluginFlags(CLI::App* command, Flags* flags, NativeCode code) {
  AddRepeated(command, "--plugin", "FILE", &flags->plugins,
              "a shared library that adds node types; may be repeated");
  flags->reads_only = code == NativeCode::kWhereToldTo;
  if (flags->reads_only) {
    AddSwitch(command, "--plugins", &flags->rig_plugins, "load the plugins that the rig names: native code");
  } else {
    AddSwitch(command, "--no-plugins", &flags->no_plugins, "load no plugin but those of --plugin");
  }
  AddRepeated(command, "--trust", "FOLDER", &flags->trust,
              "files in it may be named by the rig, too, besides those in its own folder; may be repeated");
}

void AddTimeFlags(CLI::App* command, Flags* flags) {
  AddOption(command, "--frames", "A:B[:S]", &flags->frames,
            "frames A to B, both included, every S-th; frame f is at f / fps");
  AddOption(command, "--times", "T,T,...", &flags->times, "times in seconds");
}

void AddOutputFlags(CLI::App* command, Flags* flags, const std::string& doc) {
  AddOption(command, "-o,--output", "FILE", &flags->output, doc);
  AddSwitch(command, "--force", &flags->force, "replace an existing output");
}

void AddThreadsFlag(CLI::App* command, Flags* flags) {
  AddOption(command, "--threads", "N", &flags->threads,
            "threads to use; as many as there are cores if not given");
}

void AddQuietFlag(CLI::App* command, Flags* flags) {
  AddSwitch(command, "-q,--quiet", &flags->quiet, "no messages but errors");
}

void AddJsonFlag(CLI::App* command, Flags* flags) {
  AddSwitch(command, "--json", &flags->json, "print JSON to stdout");
}

Result<int> ThreadCount(const Flags& flags) {
  if (!flags.threads.has_value()) return 0;
  return ParseCount("--threads", *flags.threads, 1, 1024);
}

void AddAllNodes(NodeRegistry& registry) {
  AddStandardNodes(registry);
  AddKpsaNode(registry);
}

Status LoadPlugins(const Flags& flags, PluginLoader* loader) {
  for (const std::string& file : flags.plugins) KPSA_RETURN_IF_ERROR(loader->Load(file).At({"--plugin"}));
  if (flags.no_plugins)
    loader->RefuseOthers("--no-plugins");
  else if (flags.reads_only && !flags.rig_plugins)
    loader->RefuseOthers(
        "this command runs no native code unless told to; expected --plugins, or --plugin with its name");
  return Status();
}

Result<std::unique_ptr<OpenRig>> LoadRigOf(const Flags& flags) {
  RigOptions options;
  options.variant = flags.variant;
  if (flags.fps.has_value()) {
    const Result<double> fps = ParseNumber("--fps", *flags.fps);
    if (!fps.ok()) return fps.status();
    if (*fps < 1e-3 || *fps > 1e6)
      return Status::Usage("--fps {}: expected a number of frames from 0.001 to 1,000,000 a second",
                           *flags.fps);
    options.fps = *fps;
  }
  if (flags.rest && flags.clip.has_value())
    return Status::Usage("--rest and --clip {}: expected one of them", *flags.clip);
  options.rest = flags.rest;
  auto open = std::make_unique<OpenRig>();
  AddAllNodes(open->registry);
  PluginLoader plugins(&open->registry);
  KPSA_RETURN_IF_ERROR(LoadPlugins(flags, &plugins));
  options.plugins = &plugins;
  options.trust = flags.trust, options.trust_word = "--trust";
  Result<Rig> rig = LoadRig(open->registry, flags.file, options);
  if (!rig.ok()) return rig.status();
  open->rig = std::move(*rig);
  if (flags.clip.has_value())
    KPSA_RETURN_IF_ERROR(AsUsage(SetClip(&open->rig, *flags.clip).At({flags.file})));
  if (flags.pose.has_value()) {
    const Result<PoseFile> pose = ReadPoseFile(open->rig, *flags.pose);
    if (!pose.ok()) return pose.status();
    // The pose belongs to its clip, unless the command line names another
    if (pose->clip.has_value() && !flags.clip.has_value() && !flags.rest) {
      const std::optional<std::string_view> clip =
          pose->clip->empty() ? std::nullopt : std::optional<std::string_view>(*pose->clip);
      KPSA_RETURN_IF_ERROR(SetClip(&open->rig, clip).At({*flags.pose}));
      open->pose_time = pose->time.value_or(0);
    }
    for (const Setting& setting : pose->settings)
      KPSA_RETURN_IF_ERROR(ApplySetting(&open->rig, setting).At({*flags.pose}));
  }
  for (const std::string& text : flags.sets) {
    const Result<Setting> setting = ParseSetting(open->rig, text);
    if (!setting.ok()) return AsUsage(Status(setting.status()).At({"--set " + text}));
    KPSA_RETURN_IF_ERROR(AsUsage(ApplySetting(&open->rig, *setting).At({"--set " + text})));
  }
  return open;
}

RigOpener OpenerOf(const Flags& flags) {
  RigOpener source;
  source.path = flags.file;
  source.open = [flags](const RigChange& change) {
    Flags changed = flags;
    if (change.clip.has_value()) changed.clip = change.clip;
    if (change.variant.has_value()) changed.variant = change.variant;
    return LoadRigOf(changed);
  };
  source.times = [flags](const OpenRig& open) { return SampleTimes(flags, open); };
  return source;
}

Status AsUsage(Status status) {
  Status usage;
  for (Error error : status.errors()) {
    error.kind = ErrorKind::kUsage;
    usage.Add(std::move(error));
  }
  return usage;
}

std::vector<std::string> SplitNames(const std::string& text) {
  std::vector<std::string> names;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    if (end > begin) names.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return names;
}

int ExitCode(const Status& status) {
  if (status.ok()) return 0;
  switch (status.kind()) {
    case ErrorKind::kDiffers:
      return 1;
    case ErrorKind::kUsage:
      return 2;
    case ErrorKind::kInvalidInput:
      return 3;
    case ErrorKind::kEvaluation:
      return 4;
    case ErrorKind::kInterrupted:
      return 130;
  }
  return 3;
}

void PrintErrors(const std::string& program, const Status& status, std::size_t most_lines) {
  std::vector<std::string> lines;
  for (const Error& error : status.errors()) {
    std::string text = error.ToString();
    for (char& c : text) {
      // A file's names must not write on the terminal
      if (c != '\n' && c != '\t' && (static_cast<unsigned char>(c) < 32 || c == 127)) c = '?';
    }
    std::size_t begin = 0;
    for (std::size_t end = text.find('\n');; end = text.find('\n', begin)) {
      std::string line = text.substr(begin, end == std::string::npos ? end : end - begin);
      if (line.size() > 600) line = line.substr(0, 597) + "...";
      lines.push_back(begin == 0 ? program + ": " + line : "  " + line);
      if (end == std::string::npos) break;
      begin = end + 1;
    }
  }
  const std::size_t shown = lines.size() <= most_lines ? lines.size() : most_lines - 1;
  for (std::size_t i = 0; i < shown; ++i) Say(lines[i]);
  if (shown < lines.size())
    Say(fmt::format("{}: ... and {} more lines (kpsa validate lists all errors)", program,
                    lines.size() - shown));
}

void Say(const std::string& line) {
  std::fwrite(line.data(), 1, line.size(), stderr);
  std::fputc('\n', stderr);
}

void Print(const std::string& text) { std::fwrite(text.data(), 1, text.size(), stdout); }

Status FlushOutput() {
  if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0)
    return Status::Invalid("stdout cannot be written");
  return Status();
}

}  // namespace kpsa::engine
