#include "files/trusted_folders.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "tests/support/temporary_folder.h"

namespace kpsa::engine {
namespace {

namespace fs = std::filesystem;

// rig/ is what is trusted; outside/ is beside it.
class TrustedFoldersTest : public ::testing::Test {
 protected:
  TrustedFoldersTest() {
    folder.Write("rig/sub/a.txt", "a");
    folder.Write("outside/b.txt", "b");
    folder.Write("rigid/c.txt", "begins as the folder's name does");
  }
  bool Holds(const std::string& path) const {
    TrustedFolders trusted;
    EXPECT_TRUE(trusted.Add(folder / "rig"));
    return trusted.Hold(folder / path);
  }
  TemporaryFolder folder;
};

TEST_F(TrustedFoldersTest, HoldWhatIsWithin) {
  for (const char* path : {"rig", "rig/", "rig/sub/a.txt", "rig/sub/../sub/a.txt", "outside/../rig/sub/a.txt",
                           "rig/none.txt", "rig/none/../none.txt", "rig/..hidden", "rig/./sub//a.txt"})
    EXPECT_TRUE(Holds(path)) << path;
  for (const char* path : {"", "outside/b.txt", "rig/..", "rig/../outside/b.txt", "rigid/c.txt",
                           "rig/none/../../outside/b.txt", "rig/sub/../../none.txt"})
    EXPECT_FALSE(Holds(path)) << path;
  // What is opened ends at a zero byte
  EXPECT_FALSE(Holds(std::string("rig/../outside/b.txt\0/../../rig/sub/a.txt", 41)));
  EXPECT_FALSE(TrustedFolders().Hold(folder / "rig")) << "none is trusted";
}

TEST_F(TrustedFoldersTest, LinksCountByWhereTheyLead) {
  fs::create_symlink(folder / "outside/b.txt", folder / "rig/file");
  fs::create_directory_symlink("../outside", folder / "rig/folder");
  fs::create_symlink("file", folder / "rig/to_file");
  fs::create_symlink("sub/a.txt", folder / "rig/within");
  fs::create_directory_symlink("rig", folder / "in");
  fs::create_symlink(folder / "outside/none.txt", folder / "rig/nowhere");
  fs::create_symlink("round", folder / "rig/round");
  for (const char* path : {"rig/file", "rig/folder", "rig/folder/b.txt", "rig/folder/none.txt", "rig/to_file",
                           "rig/sub/../folder/b.txt", "rig/nowhere", "rig/nowhere/a.txt", "rig/round"})
    EXPECT_FALSE(Holds(path)) << path;
  EXPECT_TRUE(Holds("rig/within"));
  EXPECT_TRUE(Holds("in/sub/a.txt")) << "a link from outside";
  // `..` goes up from where a link leads, as the system does: not back to rig/
  EXPECT_FALSE(Holds("rig/folder/../b.txt"));
}

TEST_F(TrustedFoldersTest, OfARigAreItsFolderItsProjectAndThoseThatAreNamed) {
  const std::string rig = folder.Write("show/rigs/face/rig.yaml", ""),
                    part = folder.Write("show/parts/p.yaml", ""), other = folder.Write("outside/o.yaml", "");
  ASSERT_EQ(setenv("KPSA_TRUST", "", 1), 0);
  const auto holds = [&](const std::string& path, const std::vector<std::string>& others = {}) {
    const Result<TrustedFolders> trusted = TrustedFolders::OfRig(rig, others);
    return trusted.ok() && trusted->Check(path).ok();
  };
  EXPECT_TRUE(holds(rig));
  EXPECT_FALSE(holds(part));
  EXPECT_TRUE(holds(part, {folder / "outside", folder / "show/parts"}));
  EXPECT_FALSE(holds(rig, {folder / "nowhere"})) << "a folder that is not there";
  EXPECT_FALSE(holds(rig, {""}));
  EXPECT_EQ(TrustedFolders::OfRig(rig, {rig}).status().kind(), ErrorKind::kUsage);

  folder.Write("show/kpsa.project", "");
  EXPECT_TRUE(holds(part));
  EXPECT_FALSE(holds(other));
  folder.Write("show/rigs/kpsa.project", "");
  EXPECT_FALSE(holds(part)) << "the innermost project counts";
  fs::remove(folder / "show/rigs/kpsa.project");
  fs::rename(folder / "show/kpsa.project", folder / "elsewhere");
  fs::create_symlink(folder / "elsewhere", folder / "show/kpsa.project");
  EXPECT_FALSE(holds(part)) << "a link makes no project";

  ASSERT_EQ(setenv("KPSA_TRUST", (folder / "nowhere" + ":" + folder.path() + "/outside::").c_str(), 1), 0);
  EXPECT_TRUE(holds(other));
  EXPECT_FALSE(holds(part));
  ASSERT_EQ(unsetenv("KPSA_TRUST"), 0);
}

}  // namespace
}  // namespace kpsa::engine
