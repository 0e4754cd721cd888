#include "cli/describe.h"

#include <CLI/CLI.hpp>
#include <algorithm>

namespace kpsa::engine {
namespace {

// "refuse|miss" as words; none where the value is something else ("face|NAME").
std::vector<std::string> ChoicesOf(const std::string& value) {
  std::vector<std::string> words;
  if (value.find('|') == std::string::npos) return words;
  for (std::size_t begin = 0; begin <= value.size();) {
    const std::size_t end = std::min(value.find('|', begin), value.size());
    const std::string word = value.substr(begin, end - begin);
    if (!std::all_of(word.begin(), word.end(), [](char c) { return (c >= 'a' && c <= 'z') || c == '-'; }))
      return {};
    words.push_back(word);
    begin = end + 1;
  }
  return words;
}

OptionDoc DescribeOption(const CLI::Option& option) {
  OptionDoc doc;
  doc.positional = option.get_positional();
  if (doc.positional) {
    doc.names = {option.get_name(true, false)};
  } else {
    for (const std::string& name : option.get_snames()) doc.names.push_back("-" + name);
    for (const std::string& name : option.get_lnames()) doc.names.push_back("--" + name);
    if (option.get_items_expected_max() > 0) doc.value = option.get_type_name();
  }
  doc.doc = option.get_description();
  doc.required = option.get_required();
  doc.repeated = option.get_items_expected_max() > 1;
  doc.choices = ChoicesOf(option.get_type_name());
  const std::string& what = doc.positional ? doc.names.front() : doc.value;
  doc.takes_file =
      what.starts_with("FILE") || what == "RIG" || what == "MAP" || what == "FOLDER" || what == "CHARACTER";
  return doc;
}

}  // namespace

CommandDoc Describe(const CLI::App& command) {
  CommandDoc doc;
  doc.name = command.get_name();
  doc.doc = command.get_description();
  doc.footer = command.get_footer();
  for (const CLI::Option* option : command.get_options()) doc.options.push_back(DescribeOption(*option));
  for (const CLI::App* own : command.get_subcommands([](const CLI::App*) { return true; }))
    doc.commands.push_back(Describe(*own));
  for (CommandDoc& own : doc.commands) {  // whose argument is a command
    for (OptionDoc& option : own.options) {
      if (own.name != "help" || !option.positional) continue;
      for (const CommandDoc& other : doc.commands) option.choices.push_back(other.name);
    }
  }
  return doc;
}

}  // namespace kpsa::engine
