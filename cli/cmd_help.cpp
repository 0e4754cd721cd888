// kpsa help: in the list of commands; the program itself makes `kpsa COMMAND --help` of it.
#include <memory>

#include "cli/options.h"

namespace kpsa::engine {

void AddHelpCommand(CLI::App* program, Command* chosen) {
  auto commands = std::make_shared<std::vector<std::string>>();
  CLI::App* command = AddCommand(program, "help", "The help of a command",
                                 "Examples:\n"
                                 "  kpsa help eval\n"
                                 "  kpsa help weights import",
                                 chosen, [commands] { return CommandResult(0); });
  AddRepeated(command, "COMMAND", "COMMAND", commands.get(), "a command, and one of its own");
}

}  // namespace kpsa::engine
