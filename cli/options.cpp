#include "cli/options.h"

#include <CLI/CLI.hpp>
#include <memory>

#include "cli/memory_limit.h"

namespace kpsa::engine {

CLI::App* AddCommand(CLI::App* program, const std::string& name, const std::string& doc,
                     const std::string& examples, Command* chosen, Command run) {
  CLI::App* command = program->add_subcommand(name, doc);
  command->footer(examples);
  const auto memory = std::make_shared<std::optional<std::string>>();
  AddOption(command, "--max-memory", "SIZE", memory.get(),
            "of address space, as 500MB or 2GB: what needs more is an error, not a machine without memory");
  command->callback([chosen, memory, run = std::move(run)] {
    *chosen = [memory, run]() -> CommandResult {
      if (memory->has_value()) KPSA_RETURN_IF_ERROR(LimitMemory(**memory));
      return run();
    };
  });
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

void AddRequired(CLI::App* command, const std::string& name, std::string* to, const std::string& doc,
                 const std::string& value) {
  CLI::Option* option = command->add_option(name, *to, doc)->required()->check([](const std::string& text) {
    return text.empty() ? std::string("expected the name of a file, found an empty text") : std::string();
  });
  if (!value.empty()) option->type_name(value);
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
