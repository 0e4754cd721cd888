// Every line of shell in README.md works as it stands there.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <sstream>

#include "tests/cli/hello_folder.h"
#include "tests/cli/process.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine {
namespace {

namespace fs = std::filesystem;
const fs::path kProject = fs::path(KPSA_SCENES_DIR).parent_path();
constexpr double kMostSeconds = 300;  // of a line, under a sanitizer

std::string Trim(const std::string& text) {
  const std::size_t begin = text.find_first_not_of(" \t"), end = text.find_last_not_of(" \t\r");
  return begin == std::string::npos ? "" : text.substr(begin, end + 1 - begin);
}

std::string WithoutComment(const std::string& line) {
  if (line.starts_with('#')) return "";
  return Trim(line.substr(0, line.find(" #")));
}

std::vector<std::string> Words(const std::string& line) {
  std::istringstream in(line);
  std::vector<std::string> words;
  for (std::string word; in >> word;) words.push_back(word);
  return words;
}

// The lines of all ```sh blocks, without comments and empty lines.
std::vector<std::string> ShellLines(const std::string& markdown) {
  std::istringstream in(markdown);
  std::vector<std::string> lines;
  bool inside = false;
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("```")) {
      inside = Trim(line) == "```sh";
    } else if (const std::string command = WithoutComment(line); inside && !command.empty()) {
      lines.push_back(command);
    }
  }
  return lines;
}

// What is wrong with a script, which takes minutes when it runs: a kpsa command, option or scene that does
// not exist.
std::string ScriptProblem(const fs::path& script) {
  if (!fs::is_regular_file(script)) return "no such script";
  if (RunShell("sh -n '" + script.string() + "'", kMostSeconds, "/").exit_code != 0)
    return "is no shell script";
  std::istringstream in(TemporaryFolder::Read(script.string()));
  for (std::string line; std::getline(in, line);) {
    const std::vector<std::string> words = Words(WithoutComment(line));
    if (words.size() < 2 || words[0] != "build/kpsa") continue;
    const ProcessResult help = RunKpsa({words[1], "--help"});
    if (help.out.find("kpsa " + words[1] + " ") == std::string::npos)
      return fmt::format("no command {}", words[1]);  // the help of all
    for (std::size_t i = 2; i < words.size(); ++i) {
      const std::string& word = words[i];
      if (word.starts_with("scenes/") && !fs::exists(kProject / word)) return fmt::format("no file {}", word);
      if (word.starts_with('-') && help.out.find(word) == std::string::npos)
        return fmt::format("{} has no option {}", words[1], word);
    }
  }
  return "";
}

// A folder with what a newcomer has after the build, in which the lines run.
class ReadmeTest : public ::testing::Test {
 protected:
  ReadmeTest() {
    fs::create_directory(folder_ / "build");
    fs::create_symlink(KPSA_PROGRAM, folder_ / "build/kpsa");
    fs::create_directory_symlink(KPSA_SCENES_DIR, folder_ / "scenes");
    folder_.Write("CHAR.glb", HelloFolder::Columns());
  }
  // One entry for each line that does not do what it says.
  std::vector<std::string> Problems(const std::string& markdown) const {
    std::vector<std::string> problems;
    for (const std::string& line : ShellLines(markdown)) {
      const std::vector<std::string> words = Words(line);
      std::string problem;
      if (words.size() == 2 && words[0] == "sh") {
        problem = ScriptProblem(kProject / words[1]);
      } else {
        const ProcessResult run = RunShell(line, kMostSeconds, folder_.path());
        if (run.exit_code != 0) problem = fmt::format("exit {}\n{}", run.exit_code, run.err);
        for (std::size_t i = 0; i + 1 < words.size() && problem.empty(); ++i) {
          if (words[i] == "-o" && !fs::exists(folder_ / words[i + 1]))
            problem = words[i + 1] + " was not written";
        }
      }
      if (!problem.empty()) problems.push_back(line + ": " + problem);
    }
    return problems;
  }
  static std::string Text() { return TemporaryFolder::Read((kProject / "README.md").string()); }

  TemporaryFolder folder_;
};

TEST_F(ReadmeTest, EveryLineWorks) {
  const std::vector<std::string> lines = ShellLines(Text());
  EXPECT_GE(lines.size(), 8u);
  for (const char* line :
       {"sh scenes/demo.sh", "sh tests/run.sh", "build/kpsa train char.yaml", "build/kpsa bench char.yaml"}) {
    EXPECT_NE(std::find(lines.begin(), lines.end(), line), lines.end()) << line;
  }
  for (const std::string& problem : Problems(Text())) ADD_FAILURE() << problem;
  EXPECT_TRUE(fs::exists(folder_ / "char.kpsa"));
}

TEST_F(ReadmeTest, CanaryOfInventedLines) {
  // A copy of which no line is right
  std::string copy = Text();
  for (const auto& [right, wrong] :
       {std::pair("build/kpsa ", "build/kpsa quickly-"), std::pair("sh scenes/", "sh scenes/no-"),
        std::pair("sh tests/", "sh tests/no-")}) {
    for (std::size_t at = copy.find(right); at != std::string::npos; at = copy.find(right, at + 1)) {
      copy.replace(at, std::string(right).size(), wrong);
    }
  }
  EXPECT_EQ(Problems(copy).size(), ShellLines(Text()).size());
  EXPECT_EQ(Problems("```sh\nbuild/kpsa eval scenes/hello/hello.yaml --rapidly -o a.npz\n```\n").size(), 1u);
  EXPECT_EQ(Problems("```sh\nbuild/kpsa eval scenes/none.yaml -o a.npz\n```\n").size(), 1u);
  EXPECT_EQ(Problems("```sh\nbuild/kpsa --version -o a.npz # says the version\n```\n").size(), 1u);
  EXPECT_EQ(Problems("```sh\nbuild/kpsa --version  # no more than that\n```\n").size(), 0u);
  EXPECT_EQ(Problems("```cpp\nnothing\n```\n").size(), 0u);
}

TEST_F(ReadmeTest, CanaryOfInventedScripts) {
  EXPECT_EQ(ScriptProblem(folder_.Write("a.sh", "set -e\nbuild/kpsa bench scenes/hello/hello.yaml --json\n")),
            "");
  EXPECT_EQ(ScriptProblem(folder_.Write("a.sh", "build/kpsa forget scenes/hello/hello.yaml\n")),
            "no command forget");
  EXPECT_EQ(ScriptProblem(folder_.Write("a.sh", "build/kpsa bench scenes/hello/hello.yaml --swift\n")),
            "bench has no option --swift");
  EXPECT_EQ(ScriptProblem(folder_.Write("a.sh", "build/kpsa bench scenes/none.yaml\n")),
            "no file scenes/none.yaml");
  EXPECT_EQ(ScriptProblem(folder_.Write("a.sh", "if\n")), "is no shell script");
  EXPECT_EQ(ScriptProblem(folder_ / "b.sh"), "no such script");
}

}  // namespace
}  // namespace kpsa::engine
