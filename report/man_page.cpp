#include <fmt/format.h>
#include <fmt/ranges.h>

#include <sstream>

#include "report/command_docs.h"

namespace kpsa::engine {
namespace {

// As roff prints it: its own marks escaped, hyphens that can be copied.
std::string Roff(std::string_view text) {
  std::string escaped;
  for (const char c : text) {
    if (c == '\\') {
      escaped += "\\e";
    } else if (c == '-') {
      escaped += "\\-";
    } else {
      if ((c == '.' || c == '\'') && (escaped.empty() || escaped.back() == '\n')) escaped += "\\&";
      escaped += c;
    }
  }
  return escaped;
}

std::string SynopsisOf(const std::string& path, const CommandDoc& command) {
  std::string text = "\\fB" + Roff(path) + "\\fR";
  if (!command.commands.empty()) return text + " \\fICOMMAND\\fR ...";
  for (const OptionDoc& option : command.options) {
    if (!option.positional) continue;
    const std::string name = "\\fI" + Roff(option.names.front()) + "\\fR" + (option.repeated ? " ..." : "");
    text += option.required ? " " + name : " [" + name + "]";
  }
  return text + " [\\fIoptions\\fR]";
}

// Notes as text, what follows "Examples:" or is indented line by line.
std::string NotesOf(const std::string& footer) {
  std::istringstream lines(footer);
  std::string text, line;
  bool examples = false;
  while (std::getline(lines, line)) {
    if (line.empty()) {
      text += ".PP\n";
      continue;
    }
    if (line.starts_with("  ") != examples) {
      examples = !examples;
      text += examples ? ".nf\n" : ".fi\n";
    } else if (!examples) {
      text += ".br\n";
    }
    text += Roff(line) + "\n";
  }
  return text + (examples ? ".fi\n" : "");
}

void AddOptions(const CommandDoc& command, std::string* text) {
  for (const OptionDoc& option : command.options) {
    std::vector<std::string> names;
    for (const std::string& name : option.names)
      names.push_back((option.positional ? "\\fI" : "\\fB") + Roff(name) + "\\fR");
    *text += fmt::format(".TP\n{}{}\n{}\n", fmt::join(names, ", "),
                         option.value.empty() ? "" : " \\fI" + Roff(option.value) + "\\fR", Roff(option.doc));
  }
}

void AddCommands(const CommandDoc& command, const std::string& path, std::string* text) {
  for (const CommandDoc& own : command.commands) {
    const std::string name = path + " " + own.name;
    *text += fmt::format(".SS {}\n{}\n.PP\n{}.\n", Roff(name), SynopsisOf(name, own), Roff(own.doc));
    AddOptions(own, text);
    if (!own.footer.empty()) *text += ".PP\n" + NotesOf(own.footer);
    AddCommands(own, name, text);
  }
}

}  // namespace

std::string ManPage(const CommandDoc& program, std::string_view version) {
  std::string upper = program.name;
  for (char& c : upper) c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  const std::size_t colon = program.doc.find(": ");
  std::string text = fmt::format(
      ".TH {} 1 \"\" \"{}\" \"\"\n.SH NAME\n{} \\- {}\n.SH SYNOPSIS\n{}\n.SH OPTIONS\n", upper, Roff(version),
      program.name, Roff(colon == std::string::npos ? program.doc : program.doc.substr(colon + 2)),
      SynopsisOf(program.name, program));
  AddOptions(program, &text);
  text += ".SH COMMANDS\n";
  AddCommands(program, program.name, &text);
  return text + ".SH NOTES\n" + NotesOf(program.footer);
}

}  // namespace kpsa::engine
