// What the subcommands share: flags, loading a rig with them, exit codes, and printing.
//
// Data goes to stdout, everything else to stderr. Exit codes: 0 fine, 1 a check failed, things
// differ or training would not pay, 2 usage, 3 invalid input, 4 evaluation error, 130 interrupted.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/quantity_text.h"
#include "base/status.h"
#include "base/text.h"
#include "graph/node_registry.h"
#include "graph/plugin_loader.h"
#include "host/open_rig.h"
#include "report/json_text.h"
#include "rig/build/rig_builder.h"

namespace CLI {
class App;
}

namespace kpsa::engine {

// The flags that several subcommands have, as they were typed; unset where they were not given.
struct Flags {
  std::string file;               // the rig or character
  std::vector<std::string> sets;  // --set plug=value
  std::vector<std::string> plugins;
  std::vector<std::string> trust;                                    // --trust folder
  bool reads_only = false, rig_plugins = false, no_plugins = false;  // NativeCode, --plugins, --no-plugins
  std::optional<std::string> pose, clip, fps, variant;
  bool rest = false;
  std::optional<std::string> frames, times;
  std::optional<std::string> threads;
  std::optional<std::string> output;
  bool force = false, quiet = false, json = false;
};

// Which libraries of nodes a command loads besides those of --plugin: commands that only read load none unless told to.
enum class NativeCode : std::uint8_t { kWhatRigsName, kWhereToldTo };

// FILE --set --pose --clip --rest --fps --variant, and those of plugins
void AddRigFlags(CLI::App* command, Flags* flags, NativeCode code = NativeCode::kWhatRigsName);
// The same without FILE; with or without --clip
void AddPoseFlags(CLI::App* command, Flags* flags, bool clip, NativeCode code = NativeCode::kWhatRigsName);
// --plugin, --no-plugins or --plugins, and --trust: what a rig may do
void AddPluginFlags(CLI::App* command, Flags* flags, NativeCode code = NativeCode::kWhatRigsName);
void AddTimeFlags(CLI::App* command, Flags* flags);                            // --frames --times
void AddOutputFlags(CLI::App* command, Flags* flags, const std::string& doc);  // -o --force
void AddThreadsFlag(CLI::App* command, Flags* flags);
void AddQuietFlag(CLI::App* command, Flags* flags);
void AddJsonFlag(CLI::App* command, Flags* flags);

// --threads as a number, 0 where it was not given.
Result<int> ThreadCount(const Flags& flags);

// Every node type of the program: the standard ones and KPSA's.
void AddAllNodes(NodeRegistry& registry);
// The libraries of --plugin; whether the loader loads others is as the flags say.
Status LoadPlugins(const Flags& flags, PluginLoader* loader);

// Loads the rig of the flags, with the clip, the pose file and the settings that they name. Mistakes in flags
// are usage errors.
Result<std::unique_ptr<OpenRig>> LoadRigOf(const Flags& flags);
// The same as often as it is wanted; times: those of --frames, --times or the clip.
RigOpener OpenerOf(const Flags& flags);

// The same errors as errors of usage: their cause stands on the command line.
Status AsUsage(Status status);

// "a,b" of a flag; empty names are left out.
std::vector<std::string> SplitNames(const std::string& text);

int ExitCode(const Status& status);
// At most five lines to stderr; `program` is "kpsa eval", say.
void PrintErrors(const std::string& program, const Status& status, std::size_t most_lines = 5);
// A line to stderr.
void Say(const std::string& line);
// Text to stdout; at the end of the program a failed write is an error (FlushOutput).
void Print(const std::string& text);
Status FlushOutput();
// A JSON value of any type that dumps as nlohmann's do.
template <typename Json>
void PrintJson(const Json& json) {
  Print(JsonText(json));
}

}  // namespace kpsa::engine
