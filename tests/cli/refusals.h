// What holds of every refusal, whatever was wrong: the exit code, a message of one to five lines that says
// where, an empty stdout, no file made or changed, and bounds of time and memory.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "tests/cli/process.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine {

class RefusalTest : public ::testing::Test {
 protected:
#if defined(KPSA_WITH_ASAN) || defined(KPSA_WITH_TSAN)
  static constexpr double kSanitized = 4;  // how much more sanitizers take
#else
  static constexpr double kSanitized = 1;
#endif
  static constexpr double kMostSeconds = 30 * kSanitized;
  static constexpr double kMostBytes = kSanitized * (1 << 30);

  // Every file below the folder and its content.
  std::map<std::string, std::string> Files() const {
    std::map<std::string, std::string> files;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder.path())) {
      files[entry.path().string()] =
          entry.is_regular_file() ? TemporaryFolder::Read(entry.path().string()) : "";
    }
    return files;
  }
  static void ExpectBounded(const ProcessResult& run) {
    EXPECT_NE(run.exit_code, -1) << "ran longer than " << kMostSeconds << " s";
    EXPECT_LT(run.exit_code, 128) << run.err;
    EXPECT_LT(static_cast<double>(run.peak_bytes), kMostBytes);
  }
  // Runs in the folder. Each of `parts` stands in the message.
  void ExpectRefused(const std::vector<std::string>& arguments, int exit_code,
                     const std::vector<std::string>& parts) const {
    std::string line;
    for (const std::string& word : arguments) line += word + " ";
    SCOPED_TRACE(line);
    const auto before = Files();
    const ProcessResult run = RunKpsa(arguments, kMostSeconds, folder.path());
    ExpectBounded(run);
    EXPECT_EQ(run.exit_code, exit_code) << run.err;
    for (const std::string& part : parts)
      EXPECT_NE(run.err.find(part), std::string::npos) << "no \"" << part << "\" in:\n" << run.err;
    EXPECT_GE(run.error_lines(), 1u);
    EXPECT_LE(run.error_lines(), 5u) << run.err;
    EXPECT_EQ(run.out, "");
    EXPECT_TRUE(Files() == before) << "a file was made or changed";
  }
  // A rig or character of that content is refused by all that load one.
  void ExpectBadFile(const std::string& name, const std::string& content,
                     const std::vector<std::string>& parts, int exit_code = 3) const {
    folder.Write(name, content);
    ExpectRefused({"eval", name, "-o", "out.npz"}, exit_code, parts);
  }
  void ExpectGood(const std::vector<std::string>& arguments, std::string* out = nullptr) const {
    std::string line;
    for (const std::string& word : arguments) line += word + " ";
    SCOPED_TRACE(line);
    const ProcessResult run = RunKpsa(arguments, kMostSeconds, folder.path());
    ExpectBounded(run);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    if (out != nullptr) *out = run.out;
  }

  TemporaryFolder folder;
};

}  // namespace kpsa::engine
