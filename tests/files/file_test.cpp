#include "files/file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "tests/support/temporary_folder.h"

namespace kpsa::engine {
namespace {

std::span<const std::uint8_t> Bytes(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

TEST(File, WritesWholeFilesOrNothing) {
  const TemporaryFolder folder;
  const std::string path = folder / "a.bin";
  ASSERT_TRUE(WriteFileAtomically(path, false, Bytes("one")).ok());
  EXPECT_EQ(TemporaryFolder::Read(path), "one");
  const Status exists = WriteFileAtomically(path, false, Bytes("two"));
  EXPECT_EQ(exists.kind(), ErrorKind::kUsage);
  EXPECT_NE(exists.ToString().find("let it be replaced"), std::string::npos);
  EXPECT_EQ(TemporaryFolder::Read(path), "one");
  EXPECT_TRUE(WriteFileAtomically(path, true, Bytes("two")).ok());
  EXPECT_EQ(TemporaryFolder::Read(path), "two");
  // A writer that fails half-way leaves the old file and no other
  const Status failed = WriteFileAtomically(path, true, [](const ByteSink& sink) -> Status {
    KPSA_RETURN_IF_ERROR(sink(Bytes("thr")));
    return Status::Invalid("stopped");
  });
  EXPECT_EQ(failed.ToString(), "stopped");
  EXPECT_EQ(TemporaryFolder::Read(path), "two");
  EXPECT_EQ(folder.FileCount(), 1u);
}

TEST(File, RefusesWhatCannotBeWritten) {
  const TemporaryFolder folder;
  EXPECT_NE(WriteFileAtomically(folder.path(), true, Bytes("x")).ToString().find("is a folder"),
            std::string::npos);
  EXPECT_NE(WriteFileAtomically(folder / "no/a", true, Bytes("x")).ToString().find("there is no folder"),
            std::string::npos);
  EXPECT_FALSE(WriteFileAtomically("", true, Bytes("x")).ok());
  folder.Write("file", "x");
  EXPECT_FALSE(WriteFileAtomically(folder / "file/a", true, Bytes("x")).ok());
  if (::access("/dev/full", F_OK) == 0) {
    const Status full = WriteFileAtomically("/dev/full", false, Bytes("x"));
    EXPECT_NE(full.ToString().find("No space left"), std::string::npos) << full.ToString();
  }
  EXPECT_TRUE(WriteFileAtomically("/dev/null", false, Bytes("x")).ok());
  struct stat info = {};
  ASSERT_EQ(::stat("/dev/null", &info), 0);
  EXPECT_TRUE(S_ISCHR(info.st_mode));  // still the device
}

TEST(File, AppearingFilesAreNotOverwritten) {
  const TemporaryFolder folder;
  Result<OutputFile> output = OutputFile::Create(folder / "a", false);
  ASSERT_TRUE(output.ok());
  folder.Write("a", "somebody else's");
  EXPECT_FALSE(output->Commit().ok());
  EXPECT_EQ(TemporaryFolder::Read(folder / "a"), "somebody else's");
}

TEST(File, LinksStayLinks) {
  const TemporaryFolder folder;
  folder.Write("sub/a", "one");
  const auto link = [&](const std::string& to, const char* name) {
    ASSERT_EQ(::symlink(to.c_str(), (folder / name).c_str()), 0);
  };
  link("sub/a", "near");
  link(folder / "near", "far");
  link("sub/new", "dangling");
  link("loop", "loop");
  link("none/a", "nowhere");
  EXPECT_FALSE(WriteFileAtomically(folder / "far", false, Bytes("two")).ok());
  ASSERT_TRUE(WriteFileAtomically(folder / "far", true, Bytes("two")).ok());
  EXPECT_EQ(TemporaryFolder::Read(folder / "sub/a"), "two");
  ASSERT_TRUE(WriteFileAtomically(folder / "dangling", false, Bytes("three")).ok());
  EXPECT_EQ(TemporaryFolder::Read(folder / "sub/new"), "three");
  EXPECT_FALSE(WriteFileAtomically(folder / "loop", true, Bytes("x")).ok());
  EXPECT_NE(WriteFileAtomically(folder / "nowhere", true, Bytes("x")).ToString().find("there is no folder"),
            std::string::npos);
  for (const char* name : {"near", "far", "dangling", "loop", "nowhere"}) {
    struct stat info = {};
    ASSERT_EQ(::lstat((folder / name).c_str(), &info), 0);
    EXPECT_TRUE(S_ISLNK(info.st_mode)) << name;
  }
}

TEST(File, PermissionsStayWhatTheyWere) {
  const TemporaryFolder folder;
  for (const mode_t mode : {0600u, 0664u, 0755u, 0400u}) {
    const std::string path = folder.Write("a", "one");
    ASSERT_EQ(::chmod(path.c_str(), mode), 0);
    ASSERT_TRUE(WriteFileAtomically(path, true, Bytes("two")).ok());
    struct stat info = {};
    ASSERT_EQ(::stat(path.c_str(), &info), 0);
    EXPECT_EQ(info.st_mode & 0777, mode);
    ASSERT_EQ(::unlink(path.c_str()), 0);
  }
}

TEST(File, ReadsWithinTheLimit) {
  const TemporaryFolder folder;
  const std::string path = folder.Write("a", "12345");
  const auto bytes = ReadFileBytes(path, 5);
  ASSERT_TRUE(bytes.ok());
  EXPECT_EQ(bytes->size(), 5u);
  EXPECT_NE(ReadFileBytes(path, 4).status().ToString().find("larger than 4"), std::string::npos);
  EXPECT_NE(ReadFileBytes(folder.path(), 4).status().ToString().find("is a folder"), std::string::npos);
  EXPECT_NE(ReadFileBytes(folder / "none", 4).status().ToString().find("No such file"), std::string::npos);
  EXPECT_NE(ReadFileBytes("/dev/zero", 100).status().ToString().find("is a pipe or a device"),
            std::string::npos);
}

TEST(File, SaysWhatIsThereInsteadOfAMissingOne) {
  const TemporaryFolder folder;
  const auto said = [&](const std::string& name) {
    return ReadFileBytes(folder / name, 9).status().errors().front().message;
  };
  EXPECT_EQ(said("head.yaml"), "cannot be read: No such file or directory; its folder has no .yaml file");
  EXPECT_EQ(said("rigs/old/head.yaml"),
            "cannot be read: No such file or directory; there is no folder \"" + folder / "rigs" + "\"");
  for (const char* name : {"arm.yaml", "body.yaml", "character.yaml", "dog.yaml", "elephant.yaml", "arm.glb"})
    folder.Write(name, "");
  EXPECT_EQ(said("bodi.yaml"), "cannot be read: No such file or directory (did you mean \"body.yaml\"?)");
  EXPECT_EQ(said("unlike-all-of-them.glb"),
            "cannot be read: No such file or directory; its folder has arm.glb");
  EXPECT_EQ(said("unlike-all-of-them.yaml"),
            "cannot be read: No such file or directory; its folder has arm.yaml, body.yaml, character.yaml, "
            "dog.yaml and 1 more");
  EXPECT_EQ(said("unlike"), "cannot be read: No such file or directory");
  folder.Write("file", "");
  EXPECT_EQ(said("file/head.yaml"), "cannot be read: Not a directory");
}

}  // namespace
}  // namespace kpsa::engine
