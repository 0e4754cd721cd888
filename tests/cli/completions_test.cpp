// What the program says of its commands and flags to shells and to man is all that --help says.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <sstream>

#include "tests/cli/process.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine {
namespace {

using Lines = std::vector<std::string>;

std::string Printed(const Lines& arguments) {
  const ProcessResult run = RunKpsa(arguments);
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.err, "");
  return run.out;
}

// What the help of a command lists: the first words of the indented lines of a section, flags apart.
std::set<std::string> Listed(const std::string& help, const std::string& section) {
  std::set<std::string> words;
  std::istringstream in(help);
  bool inside = false;
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("  ") && inside) {
      std::istringstream names(line.substr(2, line.find(' ', 2) - 2));
      for (std::string name; std::getline(names, name, ',');) words.insert(name);
    } else {
      inside = line == section;
    }
  }
  return words;
}

// Every command by the words that lead to it, with its flags and its own commands.
struct CommandHelp {
  Lines path;
  std::set<std::string> flags, commands;
};
std::vector<CommandHelp> AllCommands() {
  std::vector<CommandHelp> all;
  std::vector<Lines> open = {{}};
  while (!open.empty()) {
    CommandHelp told;
    told.path = open.back();
    open.pop_back();
    Lines words = told.path;
    words.push_back("--help");
    const std::string help = Printed(words);
    told.flags = Listed(help, "Options:");
    told.commands = Listed(help, "Subcommands:");
    for (const std::string& command : told.commands) {
      open.push_back(told.path);
      open.back().push_back(command);
    }
    all.push_back(std::move(told));
  }
  return all;
}

std::string Joined(const Lines& words) {
  std::string text;
  for (const std::string& word : words) text += " " + word;
  return text;
}

TEST(Completions, BashCompletesAllThatHelpSays) {
  const TemporaryFolder folder;
  folder.Write("kpsa.bash", Printed({"completions", "bash"}));
  folder.Write("a rig.yaml", "");
  const std::vector<CommandHelp> all = AllCommands();
  ASSERT_GT(all.size(), 20u);
  std::string script =
      "source ./kpsa.bash\nask() { COMP_WORDS=(\"$@\"); COMP_CWORD=$(($# - 1)); _kpsa; printf "
      "'%s\\n' \"${COMPREPLY[@]}\" END; }\n";
  for (const CommandHelp& told : all) {
    script += "ask kpsa" + Joined(told.path) + " -\n";
    script += "ask kpsa" + Joined(told.path) + " ''\n";
  }
  script +=
      "ask kpsa eval a --stale ''\nask kpsa weights exp\nask kpsa eval 'a r'\nask kpsa eval --pose ''\n"
      "ask kpsa help we\nask kpsa eval --set ''\n";
  folder.Write("ask.sh", script);
  const ProcessResult run = RunShell("bash ask.sh", 60, folder.path());
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.err, "");
  std::istringstream in(run.out);
  const auto answer = [&] {
    std::set<std::string> words;
    for (std::string line; std::getline(in, line) && line != "END";) {
      if (!line.empty()) words.insert(line);
    }
    return words;
  };
  for (const CommandHelp& told : all) {
    EXPECT_EQ(answer(), told.flags) << Joined(told.path);
    const std::set<std::string> first = answer();
    for (const std::string& command : told.commands) EXPECT_EQ(first.count(command), 1u) << command;
  }
  EXPECT_EQ(answer(), (std::set<std::string>{"refuse", "miss"}));
  EXPECT_EQ(answer(), std::set<std::string>{"export"});
  EXPECT_EQ(answer(), std::set<std::string>{"a rig.yaml"});
  EXPECT_EQ(answer().count("kpsa.bash"), 1u);
  EXPECT_EQ(answer(), std::set<std::string>{"weights"});
  EXPECT_EQ(answer(), std::set<std::string>());
}

// The lines that a user has begun, as zsh and fish complete them.
const char* const kBegun[] = {"kpsa ev",          "kpsa eval --thr",
                              "kpsa weights exp", "kpsa eval a --stale re",
                              "kpsa help we",     "kpsa completions z"};
const char* const kCompleted[] = {"kpsa eval ",           "kpsa eval --threads ",
                                  "kpsa weights export ", "kpsa eval a --stale refuse ",
                                  "kpsa help weights ",   "kpsa completions zsh "};

TEST(Completions, ZshCompletesWhatIsBegun) {
  if (RunShell("command -v zsh", 60, "/").exit_code != 0) GTEST_SKIP() << "there is no zsh here";
  const TemporaryFolder folder;
  folder.Write("_kpsa", Printed({"completions", "zsh"}));
  // In a terminal of its own; the words of what it waits for are never echoed as such
  std::string script =
      "zmodload zsh/zpty\nzpty z zsh -f -i\n"
      "zpty -w z \"fpath=($PWD \\$fpath); autoload -Uz compinit; compinit -u -D; tell() { zle complete-word; "
      "print -r -- "
      "\\\"\\$BUFFER\\\" >> answers; BUFFER=; zle -M to'ld'; }; zle -N tell; bindkey '^I' tell; "
      "PS1='rea''dy> '\"\n"
      "zpty -r z out '*ready> *'\n";
  for (const char* line : kBegun)
    script += std::string("zpty -w -n z '") + line + "'$'\\t'\nzpty -r z out '*told*'\n";
  folder.Write("ask.zsh", script + "zpty -d z\n");
  const ProcessResult run = RunShell("zsh -f ask.zsh", 120, folder.path());
  ASSERT_EQ(run.exit_code, 0) << run.err;
  std::istringstream answers(TemporaryFolder::Read(folder / "answers"));
  for (const char* completed : kCompleted) {
    std::string answer;
    std::getline(answers, answer);
    EXPECT_EQ(answer, completed);
  }
}

TEST(Completions, FishCompletesWhatIsBegun) {
  if (RunShell("command -v fish", 60, "/").exit_code != 0) GTEST_SKIP() << "there is no fish here";
  const TemporaryFolder folder;
  folder.Write("kpsa.fish", Printed({"completions", "fish"}));
  for (std::size_t i = 0; i < std::size(kBegun); ++i) {
    const ProcessResult run =
        RunShell("HOME=$PWD XDG_CONFIG_HOME=$PWD fish --no-config -c 'source kpsa.fish; complete -C \"" +
                     std::string(kBegun[i]) + "\"'",
                 120, folder.path());
    ASSERT_EQ(run.exit_code, 0) << run.err;
    const std::string begun = kBegun[i], completed = kCompleted[i];
    const std::string word = completed.substr(begun.rfind(' ') + 1, completed.size() - begun.rfind(' ') - 2);
    std::istringstream lines(run.out);
    std::set<std::string> words;
    for (std::string line; std::getline(lines, line);) words.insert(line.substr(0, line.find('\t')));
    EXPECT_EQ(words, std::set<std::string>{word}) << begun;
  }
}

// What they are given names everything.
TEST(Completions, ZshAndFishAreGivenAllThatHelpSays) {
  const std::string zsh = Printed({"completions", "zsh"}), fish = Printed({"completions", "fish"});
  for (const CommandHelp& told : AllCommands()) {
    std::string name = "\n_kpsa";
    for (const std::string& word : told.path) name += "_" + word;
    const std::size_t begin = zsh.find(name + "() {");
    ASSERT_NE(begin, std::string::npos) << name;
    const std::string body = zsh.substr(begin, zsh.find("\n}\n", begin) - begin);
    std::string seen;  // fish's lines for this command
    std::istringstream lines(fish);
    const std::string last = told.path.empty() ? "__fish_use_subcommand" : "from " + told.path.back() + "'";
    for (std::string line; std::getline(lines, line);) {
      if (line.find(last) != std::string::npos) seen += line + "\n";
    }
    for (const std::string& flag : told.flags) {
      EXPECT_NE(body.find(flag + "["), std::string::npos) << name << " " << flag;
      const std::string as_fish = flag.starts_with("--") ? " -l " + flag.substr(2) : " -s " + flag.substr(1);
      EXPECT_NE(seen.find(as_fish + " "), std::string::npos) << Joined(told.path) << " " << flag << seen;
    }
    for (const std::string& command : told.commands) {
      EXPECT_NE(body.find("'" + command + ":"), std::string::npos) << command;
      EXPECT_NE(fish.find(" -a " + command + " -d "), std::string::npos) << command;
    }
  }
  const ProcessResult other = RunKpsa({"completions", "bahs"});
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_NE(other.err.find("did you mean \"bash\""), std::string::npos) << other.err;
}

TEST(Completions, TheManualHasAllThatHelpSays) {
  const std::string roff = Printed({"man"});
  EXPECT_EQ(roff.substr(0, 11), ".TH KPSA 1 ");
  std::string plain;
  for (std::size_t i = 0; i < roff.size(); ++i) {
    if (roff[i] == '\\' && roff[i + 1] == 'f') {
      i += 2;
    } else if (roff[i] != '\\') {
      plain += roff[i];
    }
  }
  for (const CommandHelp& told : AllCommands()) {
    if (told.path.empty()) continue;
    const std::size_t begin = plain.find(".SS kpsa" + Joined(told.path) + "\n");
    ASSERT_NE(begin, std::string::npos) << Joined(told.path);
    const std::string section = plain.substr(begin, plain.find("\n.S", begin + 1) - begin);
    for (const std::string& flag : told.flags) {
      const bool there =
          section.find("\n" + flag) != std::string::npos || section.find(", " + flag) != std::string::npos;
      EXPECT_TRUE(there) << Joined(told.path) << " " << flag;
    }
  }
  const TemporaryFolder folder;
  folder.Write("kpsa.1", roff);
  const ProcessResult set =
      RunShell("command -v groff > /dev/null || exit 0; groff -man -Tascii -ww kpsa.1 | grep -c . ", 60,
               folder.path());
  EXPECT_EQ(set.exit_code, 0);
  EXPECT_EQ(set.err, "");
}

}  // namespace
}  // namespace kpsa::engine
