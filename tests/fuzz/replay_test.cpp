// Runs every fuzzer over its corpus: seeds, and what was once found. The corpora reach what they are made for.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>

#include "tests/fuzz/fuzzer.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine {
namespace {

// What every corpus reaches, as its fuzzer calls it.
const std::map<std::string, std::set<std::string>>& CorpusMilestones() {
  static const std::map<std::string, std::set<std::string>> milestones = {
      {"caches", {"pc2", "mdd", "refused"}},
      {"expression", {"compiled", "refused"}},
      {"frames", {"frames", "times", "indices", "place", "quantity", "refused"}},
      {"gltf", {"read", "clip", "skin", "morph", "draco", "meshopt", "played", "refused"}},
      {"graph", {"plan", "lazy", "failure", "frames"}},
      {"npz", {"archive", "array", "refused"}},
      {"rig", {"formatted", "template", "include", "reference", "weights", "built", "played", "refused"}},
      {"subspace",
       {"content", "hit", "inner points", "inner points of some tiles", "inner points of some points",
        "mends", "products", "patches", "refused"}},
      {"weights", {"weights", "shape", "refused"}}};
  return milestones;
}

std::vector<std::string> FilesOf(const std::string& folder) {
  std::vector<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    files.push_back(entry.path().string());
  std::sort(files.begin(), files.end());
  return files;
}

// What it finds in the file; "" if nothing.
std::string Finding(const Fuzzer& fuzzer, const std::string& path) {
  const std::string bytes = TemporaryFolder::Read(path);
  try {
    fuzzer.run(AsBytes(bytes));
  } catch (const std::exception& finding) {
    return finding.what();
  }
  return "";
}

class Corpora : public testing::TestWithParam<Fuzzer> {};

TEST_P(Corpora, HaveNoFindings) {
  (void)TakeReached();
  const std::vector<std::string> files = FilesOf(KPSA_CORPORA "/" + std::string(GetParam().name));
  EXPECT_GE(files.size(), 3u);
  for (const std::string& file : files) EXPECT_EQ(Finding(GetParam(), file), "") << file;
  const std::set<std::string> reached = TakeReached();
  for (const std::string& milestone : CorpusMilestones().at(GetParam().name))
    EXPECT_TRUE(reached.contains(milestone)) << milestone;
}
INSTANTIATE_TEST_SUITE_P(All, Corpora, testing::ValuesIn(Fuzzers()),
                         [](const auto& info) { return std::string(info.param.name); });

TEST(FuzzReplay, AllFuzzersAreThere) {
  std::set<std::string> names, folders;
  for (const Fuzzer& fuzzer : Fuzzers()) names.insert(fuzzer.name);
  for (const std::string& folder : FilesOf(KPSA_CORPORA))
    folders.insert(std::filesystem::path(folder).filename());
  EXPECT_EQ(names, folders);
  EXPECT_EQ(names.size(), CorpusMilestones().size());
}

// What shows a replay going red.
const Fuzzer kFragile = {"fragile", [](FuzzedBytes bytes) {
                           Require(AsText(bytes) != "finding", "a check that fails");
                           if (AsText(bytes) == "crash") std::abort();
                         }};

TEST(FuzzReplay, AFailedCheckIsAFinding) {
  const TemporaryFolder folder;
  EXPECT_EQ(Finding(kFragile, folder.Write("fine", "fine")), "");
  EXPECT_EQ(Finding(kFragile, folder.Write("finding", "finding")), "a check that fails");
}

TEST(FuzzReplayDeathTest, ACrashEndsTheTest) {
  const TemporaryFolder folder;
  const std::string path = folder.Write("crash", "crash");
  EXPECT_DEATH((void)Finding(kFragile, path), "");
}

}  // namespace
}  // namespace kpsa::engine
