// The commands of a program as data, and what is made of them: a man page, and completions for shells.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "base/status.h"

namespace kpsa::engine {

struct OptionDoc {
  std::vector<std::string> names;  // "-o", "--output"; of a positional argument its name alone, "FILE"
  std::string value;               // what it takes, "FILE"; "" of a switch
  std::string doc;
  bool positional = false, required = false, repeated = false;
  std::vector<std::string> choices;  // that it may be, where these are words: "refuse|miss"
  bool takes_file = false;           // completed by names of files
};
struct CommandDoc {
  std::string name;    // "import"
  std::string doc;     // one sentence
  std::string footer;  // notes and examples
  std::vector<OptionDoc> options;
  std::vector<CommandDoc> commands;  // its own
};

// What a shell sources to complete the program: bash, zsh or fish. Errors: another shell.
Result<std::string> Completions(const CommandDoc& program, std::string_view shell);
// A man page of section 1, in roff.
std::string ManPage(const CommandDoc& program, std::string_view version);

}  // namespace kpsa::engine
