// kpsa completions, kpsa man: what the program says of itself, for shells and for man.
#include <memory>

#include "cli/common.h"
#include "cli/describe.h"
#include "cli/options.h"
#include "host/version.h"

namespace kpsa::engine {

void AddCompletionsCommand(CLI::App* program, Command* chosen) {
  auto shell = std::make_shared<std::string>();
  CLI::App* command = AddCommand(program, "completions", "What a shell reads to complete commands and flags",
                                 "Examples:\n"
                                 "  source <(kpsa completions bash)\n"
                                 "  kpsa completions zsh > ~/.zfunc/_kpsa\n"
                                 "  kpsa completions fish > ~/.config/fish/completions/kpsa.fish",
                                 chosen, [program, shell]() -> CommandResult {
                                   const Result<std::string> text = Completions(Describe(*program), *shell);
                                   if (!text.ok()) return text.status();
                                   Print(*text);
                                   return 0;
                                 });
  AddRequired(command, "SHELL", shell.get(), "whose completions", "bash|zsh|fish");
}

void AddManCommand(CLI::App* program, Command* chosen) {
  AddCommand(program, "man", "The manual page, of all commands and flags",
             "Examples:\n"
             "  kpsa man | man -l -\n"
             "  kpsa man > kpsa.1",
             chosen, [program]() -> CommandResult {
               const std::string version = VersionText();
               Print(ManPage(Describe(*program), version.substr(0, version.find(" ("))));
               return 0;
             });
}

}  // namespace kpsa::engine
