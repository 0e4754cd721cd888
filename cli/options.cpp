#include "cli/options.h"

#include <CLI/CLI.hpp>

namespace kpsa::engine {

CLI::App* AddCommand(CLI::App* program, const std::string& name, const std::string& doc,
                     const std::string& examples, Command* chosen, Command run) {
  CLI::App* command = program->add_subcommand(name, doc);
  command->footer(examples);
  command->callback([chosen, run = std::move(run)] { *chosen = run; });
  return command;
}

CLI::App* AddCommandGroup(CLI::App* program, const std::string& name, const std::string& doc,
                          const std::string& examples) {
  CLI::App* group = program->add_subcommand(name, doc);
  group->footer(examples);
  group->require_subcommand(1);
  return group;
}

void AddOption(CLI::App* command, const std::string& name, const std::string& value,
               std::optional<std::string>* to, const std::string& doc) {
  CLI::Option* option = command->add_option_function<std::string>(
      name, [to](const std::string& text) { *to = text; }, doc);
  if (!value.empty()) option->type_name(value);
}

void AddRequired(CLI::App* command, const std::string& name, std::string* to, const std::string& doc) {
  command->add_option(name, *to, doc)->required();
}

void AddRepeated(CLI::App* command, const std::string& name, const std::string& value,
                 std::vector<std::string>* to, const std::string& doc) {
  CLI::Option* option = command->add_option(name, *to, doc);
  if (!value.empty()) option->type_name(value);
  if (name.starts_with('-')) {
    option->allow_extra_args(false);
  } else {
    option->required();
  }
}

void AddSwitch(CLI::App* command, const std::string& name, bool* to, const std::string& doc) {
  command->add_flag(name, *to, doc);
}

}  // namespace kpsa::engine
