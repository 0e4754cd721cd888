// The one door to CLI11: options of a subcommand as text and flags, to be parsed and refused by the
// subcommand itself.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "cli/command.h"

namespace kpsa::engine {

// A subcommand; `examples` ends its help. When it is chosen, *chosen becomes `run`.
CLI::App* AddCommand(CLI::App* program, const std::string& name, const std::string& doc,
                     const std::string& examples, Command* chosen, Command run);

// A subcommand that is only there for those that are added to it.
CLI::App* AddCommandGroup(CLI::App* program, const std::string& name, const std::string& doc,
                          const std::string& examples);

// Positional arguments where the name has no dash. `value` names what is expected ("FILE", "A:B[:S]").
void AddOption(CLI::App* command, const std::string& name, const std::string& value,
               std::optional<std::string>* to, const std::string& doc);
void AddRequired(CLI::App* command, const std::string& name, std::string* to, const std::string& doc,
                 const std::string& value = "");
// An option that may be repeated (one value each time), or all remaining positional arguments (at least one).
void AddRepeated(CLI::App* command, const std::string& name, const std::string& value,
                 std::vector<std::string>* to, const std::string& doc);
void AddSwitch(CLI::App* command, const std::string& name, bool* to, const std::string& doc);

}  // namespace kpsa::engine
