#include <fmt/format.h>
#include <fmt/ranges.h>

#include <functional>

#include "report/command_docs.h"

namespace kpsa::engine {
namespace {

// Every command with the words that lead to it: " weights import"; the program itself is "".
using EachCommand = std::function<void(const std::string& path, const CommandDoc&)>;
void Visit(const CommandDoc& command, const std::string& path, const EachCommand& each) {
  each(path, command);
  for (const CommandDoc& own : command.commands) Visit(own, path + " " + own.name, each);
}

std::vector<std::string> NamesOf(const CommandDoc& command) {
  std::vector<std::string> names;
  for (const CommandDoc& own : command.commands) names.push_back(own.name);
  return names;
}

std::string Replaced(std::string text, std::string_view what, const std::string& with) {
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + with.size()))
    text.replace(at, what.size(), with);
  return text;
}

// Within single quotes of bash and zsh.
std::string ShellQuoted(const std::string& text) { return Replaced(text, "'", "'\\''"); }

std::string Bash(const CommandDoc& program) {
  std::string paths, values, words;
  Visit(program, "", [&](const std::string& path, const CommandDoc& command) {
    if (!path.empty()) paths += fmt::format("{}\"{}\"", paths.empty() ? "" : " | ", path);
    std::vector<std::string> all = NamesOf(command), plain, files;
    bool any_file = false;
    for (const OptionDoc& option : command.options) {
      any_file = any_file || (option.positional && option.takes_file);
      if (option.positional) {
        all.insert(all.end(), option.choices.begin(), option.choices.end());
        continue;
      }
      all.insert(all.end(), option.names.begin(), option.names.end());
      if (option.value.empty()) continue;
      std::vector<std::string> cases;
      for (const std::string& name : option.names) cases.push_back(fmt::format("\"{}:{}\"", path, name));
      if (!option.choices.empty()) {
        values += fmt::format("    {}) reply_words '{}'; return ;;\n", fmt::join(cases, " | "),
                              ShellQuoted(fmt::format("{}", fmt::join(option.choices, " "))));
      } else {
        std::vector<std::string>& of = option.takes_file ? files : plain;
        of.insert(of.end(), cases.begin(), cases.end());
      }
    }
    if (!files.empty()) values += fmt::format("    {}) reply_files; return ;;\n", fmt::join(files, " | "));
    if (!plain.empty()) values += fmt::format("    {}) return ;;\n", fmt::join(plain, " | "));
    words += fmt::format("    \"{}\") words='{}'; files={} ;;\n", path,
                         ShellQuoted(fmt::format("{}", fmt::join(all, " "))), any_file ? 1 : 0);
  });
  return "# bash completion of " + program.name + ": source this file, or install it as " + program.name +
         " among bash's completions\n_" + program.name +
         R"sh(() {
  local cur=${COMP_WORDS[COMP_CWORD]} prev=${COMP_WORDS[COMP_CWORD-1]} path= words= files=0 i
  COMPREPLY=()
  reply_words() { mapfile -t COMPREPLY < <(compgen -W "$1" -- "$cur"); }
  reply_files() { mapfile -t COMPREPLY < <(compgen -f -- "$cur"); }
  for ((i = 1; i < COMP_CWORD; ++i)); do
    case "$path ${COMP_WORDS[i]}" in
      )sh" +
         paths + R"sh() path+=" ${COMP_WORDS[i]}" ;;
    esac
  done
  case "$path:$prev" in
)sh" + values +
         R"sh(  esac
  case "$path" in
)sh" + words +
         R"sh(  esac
  if [[ $files == 1 && $cur != -* ]]; then reply_files; else reply_words "$words"; fi
}
complete -o filenames -F _)sh" +
         program.name + " " + program.name + "\n";
}

std::string ZshText(const std::string& text) {
  std::string escaped = ShellQuoted(Replaced(text, "\\", "\\\\"));
  for (const char* special : {"[", "]", ":"})
    escaped = Replaced(escaped, special, std::string("\\") + special);
  return escaped;
}

// One argument of _arguments: '*--set[plug=value]:PLUG=VALUE:'
std::string ZshOption(const OptionDoc& option) {
  const std::string action = !option.choices.empty()
                                 ? "(" + fmt::format("{}", fmt::join(option.choices, " ")) + ")"
                             : option.takes_file ? "_files"
                                                 : "";
  if (option.positional)
    return fmt::format(" \\\n    '{}:{}:{}'", option.repeated ? "*" : "", ZshText(option.names.front()),
                       action);
  std::string text;
  for (const std::string& name : option.names) {
    const std::string others =
        option.repeated || option.names.size() == 1 ? "" : fmt::format("({})", fmt::join(option.names, " "));
    text +=
        fmt::format(" \\\n    '{}{}{}[{}]", option.repeated ? "*" : "", others, name, ZshText(option.doc));
    text += option.value.empty() ? "'" : fmt::format(":{}:{}'", ZshText(option.value), action);
  }
  return text;
}

std::string Zsh(const CommandDoc& program) {
  std::string text = "#compdef " + program.name + "\n";
  Visit(program, program.name, [&](const std::string& path, const CommandDoc& command) {
    text += fmt::format("_{}() {{\n  _arguments -C", Replaced(path, " ", "_"));
    for (const OptionDoc& option : command.options) {
      if (command.commands.empty() || !option.positional) text += ZshOption(option);
    }
    if (command.commands.empty()) {
      text += "\n}\n";
      return;
    }
    text +=
        " \\\n    '1: :->command' \\\n    '*:: :->rest'\n  case $state in\n  command)\n    local -a "
        "commands=(\n";
    for (const CommandDoc& own : command.commands)
      text += fmt::format("      '{}:{}'\n", own.name, ZshText(own.doc));
    text += "    )\n    _describe command commands ;;\n  rest)\n    case $words[1] in\n";
    for (const CommandDoc& own : command.commands)
      text += fmt::format("    {}) _{}_{} ;;\n", own.name, Replaced(path, " ", "_"), own.name);
    text += "    esac ;;\n  esac\n}\n";
  });
  return text + "_" + program.name + " \"$@\"\n";
}

std::string FishText(const std::string& text) {
  return "'" + Replaced(Replaced(text, "\\", "\\\\"), "'", "\\'") + "'";
}

std::string Fish(const CommandDoc& program) {
  std::string text;
  Visit(program, "", [&](const std::string& path, const CommandDoc& command) {
    // Where the command stands alone on the line, and where it does with one of its own
    std::string here = path.empty() ? "__fish_use_subcommand" : "";
    for (std::size_t at = 1; at < path.size();) {
      const std::size_t end = std::min(path.find(' ', at), path.size());
      here += std::string(here.empty() ? "" : "; and ") + "__fish_seen_subcommand_from " +
              path.substr(at, end - at);
      at = end + 1;
    }
    const std::string alone = path.empty() || command.commands.empty()
                                  ? here
                                  : fmt::format("{}; and not __fish_seen_subcommand_from {}", here,
                                                fmt::join(NamesOf(command), " "));
    bool files = false;
    for (const CommandDoc& own : command.commands)
      text += fmt::format("complete -c {} -f -n '{}' -a {} -d {}\n", program.name, alone, own.name,
                          FishText(own.doc));
    for (const OptionDoc& option : command.options) {
      files = files || (option.positional && option.takes_file);
      if (option.positional && option.choices.empty()) continue;
      text += fmt::format("complete -c {} -n '{}'", program.name, here);
      for (const std::string& name : option.names) {
        if (!option.positional)
          text += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
      }
      if (!option.choices.empty())
        text += fmt::format(" -x -a {}", FishText(fmt::format("{}", fmt::join(option.choices, " "))));
      else if (!option.value.empty())
        text += option.takes_file ? " -r -F" : " -x";
      text += " -d " + FishText(option.doc) + "\n";
    }
    if (!files) text += fmt::format("complete -c {} -f -n '{}'\n", program.name, here);
  });
  return text;
}

}  // namespace

Result<std::string> Completions(const CommandDoc& program, std::string_view shell) {
  if (shell == "bash") return Bash(program);
  if (shell == "zsh") return Zsh(program);
  if (shell == "fish") return Fish(program);
  return Status::Usage("\"{}\": expected bash, zsh or fish{}", shell,
                       DidYouMean(shell, {"bash", "zsh", "fish"}));
}

}  // namespace kpsa::engine
