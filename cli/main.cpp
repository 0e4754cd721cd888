// The kpsa program: parses the command line, runs one subcommand, maps its errors to exit codes.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "base/cancel.h"
#include "base/simd.h"
#include "cli/command.h"
#include "cli/common.h"
#include "cli/interrupt.h"
#include "host/version.h"

namespace kpsa::engine {
namespace {

constexpr char kFirstMinutes[] =
    "kpsa evaluates character rigs, and learns to skip the slow part of them.\n\n"
    "The first five minutes, with any animated character:\n"
    "  kpsa init  head.glb                 write a starter rig, head.yaml\n"
    "  kpsa train head.yaml                learn a subspace from its clips and controls\n"
    "  kpsa bench head.yaml                full against accelerated: times, errors, hits\n\n"
    "  kpsa --help lists all commands, kpsa help COMMAND (or kpsa COMMAND --help) explains one.\n";

std::vector<std::string> CommandNames(const CLI::App& program) {
  std::vector<std::string> names;
  for (const CLI::App* command : program.get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(command->get_name());
  return names;
}

// The innermost command that was named, and what was typed for it: "kpsa weights import".
std::pair<const CLI::App*, std::string> Innermost(const CLI::App& program) {
  const CLI::App* command = &program;
  std::string name = "kpsa";
  for (auto parsed = command->get_subcommands(); !parsed.empty(); parsed = command->get_subcommands()) {
    command = parsed.front();
    name += " " + command->get_name();
  }
  return {command, name};
}

std::vector<std::string> OptionNames(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    for (const std::string& name : option->get_snames()) names.push_back("-" + name);
  }
  return names;
}

// What CLI11 refuses, in our words.
int UsageError(CLI::App& program, const CLI::ParseError& error, const std::vector<std::string>& arguments) {
  const auto& [command, name] = Innermost(program);
  std::string message = error.what();
  std::replace(message.begin(), message.end(), '\n', ' ');
  if (command == &program && !arguments.empty()) {
    const std::string& word = arguments.front();
    message = word.starts_with('-')
                  ? fmt::format("unknown option \"{}\"{}", word, DidYouMean(word, OptionNames(program)))
                  : fmt::format("unknown command \"{}\"{}", word, DidYouMean(word, CommandNames(program)));
  } else if (const std::vector<std::string> actions = CommandNames(*command);
             command != &program && !actions.empty()) {
    const std::string word = arguments.size() > 1 ? arguments[1] : "";
    message = word.empty() || word.starts_with('-')
                  ? fmt::format("expected one of {}", fmt::join(actions, ", "))
                  : fmt::format("unknown command \"{}\"{}", word, DidYouMean(word, actions));
  } else if (dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr) {
    const std::vector<std::string> extras = program.remaining(true);
    const std::string word = extras.empty() ? "" : extras.front();
    const std::string bare = word.substr(0, word.find('='));
    message = word.starts_with('-')
                  ? fmt::format("unknown option \"{}\"{}", bare, DidYouMean(bare, OptionNames(*command)))
                  : fmt::format("unexpected argument \"{}\"", word);
  } else if (dynamic_cast<const CLI::RequiredError*>(&error) != nullptr) {
    message = "expected " + message.substr(0, message.find(" is required"));
  }
  PrintErrors(name, Status::Usage("{}; see {} --help", message, name));
  return 2;
}

// 0 where all that was printed went out, else an error and `code`.
int FlushOr(int code) {
  const Status flushed = FlushOutput();
  if (flushed.ok()) return 0;
  PrintErrors("kpsa", flushed);
  return code;
}

int Main(int argc, char** argv) {
  InstallSignalHandlers();
  CLI::App program("kpsa: a runtime for character rigs, with Key Point Subspace Acceleration", "kpsa");
  program.set_version_flag("--version", [] { return VersionText(); });
  program.set_help_flag("-h,--help", "this help");
  program.require_subcommand(0, 1);
  Command chosen;
  AddInitCommand(&program, &chosen);
  AddValidateCommand(&program, &chosen);
  AddInspectCommand(&program, &chosen);
  AddFmtCommand(&program, &chosen);
  AddEvalCommand(&program, &chosen);
  AddGetCommand(&program, &chosen);
  AddPoseCommand(&program, &chosen);
  AddRenderCommand(&program, &chosen);
  AddTrainCommand(&program, &chosen);
  AddLearnCommand(&program, &chosen);
  AddBenchCommand(&program, &chosen);
  AddReportCommand(&program, &chosen);
  AddViewCommand(&program, &chosen);
  AddCompileCommand(&program, &chosen);
  AddProfileCommand(&program, &chosen);
  AddExplainCommand(&program, &chosen);
  AddCompareCommand(&program, &chosen);
  AddGraphCommand(&program, &chosen);
  AddNodesCommand(&program, &chosen);
  AddWeightsCommand(&program, &chosen);
  AddCompletionsCommand(&program, &chosen);
  AddManCommand(&program, &chosen);
  AddHelpCommand(&program, &chosen);
  // `kpsa help eval` is `kpsa eval --help`
  std::vector<const char*> words(argv, argv + argc);
  if (argc > 1 && words[1] == std::string_view("help") && (argc == 2 || *words[2] != '-')) {
    words.erase(words.begin() + 1);
    words.push_back("--help");
  }
  program.footer(
      kFirstMinutes +
      std::string("\nExit codes: 0 fine, 1 a check failed, things differ, or "
                  "training would not pay, 2 usage, 3 invalid input, 4 evaluation error, 130 interrupted."));

  try {
    program.parse(static_cast<int>(words.size()), words.data());
  } catch (const CLI::Success& success) {
    // `kpsa nosuch --help`: help is given before the word is refused
    if (words[1][0] != '-' && program.get_subcommands().empty())
      return UsageError(program, CLI::ExtrasError({words[1]}),
                        std::vector<std::string>(words.begin() + 1, words.end()));
    program.exit(success);
    return FlushOr(3);
  } catch (const CLI::ParseError& error) {
    return UsageError(program, error, std::vector<std::string>(words.begin() + 1, words.end()));
  }
  if (chosen == nullptr) {
    Print(kFirstMinutes);
    return FlushOr(3);
  }
  const std::string name = Innermost(program).second;
  if (const std::string problem = ApplySimdChoice(); !problem.empty()) {
    PrintErrors(name, Status::Usage("{}", problem));
    return 2;
  }
  CommandResult result = Status();
  try {
    const FlagCancel cancel(InterruptFlag());
    const CancelScope scope(&cancel);
    result = chosen();
  } catch (const Cancelled&) {
    result = InterruptedStatus();
  } catch (const std::bad_alloc&) {
    result = Status::Invalid("not enough memory");
  } catch (const std::exception& error) {
    result = Status::Invalid("{}", error.what());
  }
  const Status flushed = FlushOutput();
  if (!result.ok()) {
    PrintErrors(name, result.status());
    return ExitCode(result.status());
  }
  if (!flushed.ok()) {
    PrintErrors(name, flushed);
    return ExitCode(flushed);
  }
  return *result;
}

}  // namespace
}  // namespace kpsa::engine

int main(int argc, char** argv) { return kpsa::engine::Main(argc, argv); }
