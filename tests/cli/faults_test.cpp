// What goes wrong while the program runs: no memory, nodes that throw, signals, full disks. Nothing is left behind.
#include <gtest/gtest.h>
#include <signal.h>

#include <filesystem>

#include "files/file.h"
#include "files/temporaries.h"
#include "tests/cli/process.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine {
namespace {

// An evaluation that takes some minutes.
std::vector<std::string> LongEval(const std::string& output) {
  return {"eval", kHello, "--frames", "0:400000", "-o", output};
}

#if !defined(KPSA_WITH_ASAN) && !defined(KPSA_WITH_TSAN)  // whose shadows are terabytes
// From what the program cannot start with to what is enough: threads that get no memory end as an error.
TEST(Faults, TooLittleMemoryIsAnErrorAndLeavesNothing) {
  const TemporaryFolder folder;
  int failed = 0, fine = 0;
  for (int kilobytes = 60000; kilobytes <= 260000; kilobytes += 8000) {
    const ProcessResult run =
        RunShell("ulimit -c 0; ulimit -v " + std::to_string(kilobytes) + "; exec " KPSA_PROGRAM " eval " +
                     kHello + " --frames 0:2000 --threads 4 -o out.npz",
                 60, folder.path());
    const bool complete = run.exit_code == 0;
    EXPECT_EQ(folder.FileCount(), complete ? 1u : 0u) << kilobytes;
    if (complete) {
      ++fine;
      std::filesystem::remove(folder / "out.npz");
      continue;
    }
    if (run.err.find("shared libraries") != std::string::npos)
      continue;  // the loader's word: there is no program yet
    ++failed;
    EXPECT_TRUE(run.exit_code == 3 || run.exit_code == 4) << kilobytes << ": " << run.exit_code << run.err;
    EXPECT_NE(run.err.find("not enough memory"), std::string::npos) << kilobytes << run.err;
  }
  EXPECT_GT(failed, 0);
  EXPECT_GT(fine, 0);
}
#endif

TEST(Faults, ANodeThatThrowsIsNamedWithItsTime) {
  const TemporaryFolder folder;
  folder.Write("rig.yaml", std::string("kpsa: 1\ncharacter: ") + kHelloGlb +
                               "\nplugins: [" KPSA_BROKEN_PLUGINS
                               "/libplugin_explosive.so]\nnodes: {fuse: {type: fuse, input: time.time}}\n"
                               "connections: [fuse.output -> upper.rotateZ]\n");
  for (const char* threads : {"1", "4"}) {
    for (const char* output : {"out.npz", "out.usda"}) {
      const ProcessResult run = RunKpsa({"eval", folder / "rig.yaml", "--frames", "0:100", "--fps", "10",
                                         "--threads", threads, "-o", folder / output});
      EXPECT_EQ(run.exit_code, 4);
      EXPECT_NE(run.err.find("at 1.1 s: node \"fuse\" (fuse): the fuse has blown"), std::string::npos)
          << run.err;
      EXPECT_EQ(folder.FileCount(), 1u);
    }
  }
}

TEST(Faults, SignalsLeaveNothing) {
  const TemporaryFolder folder, scratch;
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    const ProcessResult run = RunKpsaInterrupted(LongEval(folder / "out.npz"), 0, signal, folder.path());
    EXPECT_EQ(run.exit_code, 130) << signal << run.err;
    EXPECT_NE(run.err.find("interrupted"), std::string::npos) << signal;
    EXPECT_EQ(folder.FileCount(), 0u) << signal;
  }
  for (const int signal : {SIGQUIT, SIGABRT}) {
    const ProcessResult run = RunKpsaInterrupted(LongEval(folder / "out.npz"), 0, signal, folder.path());
    EXPECT_EQ(run.exit_code, 128 + signal) << run.err;
    EXPECT_EQ(folder.FileCount(), 0u) << signal;
  }
  // To stdout, whose reader goes
  const ProcessResult piped = RunShell(
      "TMPDIR=" + scratch.path() + " " KPSA_PROGRAM " eval " + kHello + " --frames 0:2000 -o - | head -c 10",
      60, folder.path());
  EXPECT_EQ(piped.out.size(), 10u) << piped.err;
  EXPECT_EQ(scratch.FileCount(), 0u);
}

// What looks at no flag ends all the same.
TEST(Faults, InterruptsEndWhatIsDeepInItsWork) {
  const TemporaryFolder folder;
  const std::vector<std::string> commands[] = {
      {"render", KPSA_SCENES_DIR "/gi/gi.yaml", "--camera", "front", "--set", "bounced.samples=65536", "-o",
       folder / "out.png"},
      {"eval", KPSA_SCENES_DIR "/face/face.yaml", "--frames", "0:2400", "-o", folder / "out.glb"},
  };
  for (const std::vector<std::string>& command : commands) {
    const ProcessResult run = RunKpsaInterrupted(command, 3);
    EXPECT_EQ(run.exit_code, 130) << command[0] << run.err;
    EXPECT_EQ(folder.FileCount(), 0u) << command[0];
  }
}

TEST(Faults, AFileThatMayNotGrowIsAnError) {
  const TemporaryFolder folder;
  for (const char* output : {"out.npz", "out.pc2", "out.usda"}) {
    const ProcessResult run = RunShell(
        std::string("ulimit -f 100; exec " KPSA_PROGRAM " eval ") + kHello + " --frames 0:400 -o " + output,
        60, folder.path());
    EXPECT_EQ(run.exit_code, 3) << output << run.err;
    EXPECT_NE(run.err.find("File too large"), std::string::npos) << run.err;
    EXPECT_EQ(folder.FileCount(), 0u) << output;
  }
}

// Names, outputs and texts at the edge of what systems take.
TEST(Faults, OddOutputsAndTextsAreClearErrors) {
  const TemporaryFolder folder;
  const auto shell = [&](const std::string& words) {
    return RunShell("exec " KPSA_PROGRAM " " + words, 60, folder.path());
  };
  ProcessResult run = shell("--help > /dev/full");
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_NE(run.err.find("stdout cannot be written"), std::string::npos) << run.err;
  run = shell("eval '' -o a.npz");
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_NE(run.err.find("expected the name of a file, found an empty text"), std::string::npos) << run.err;
  // As long as a name may be, and longer
  const std::string longest = std::string(251, 'a') + ".npz";
  run = shell("eval " + kHello + " --frames 0:3 -o " + longest);
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_TRUE(std::filesystem::exists(folder / longest));
  EXPECT_EQ(folder.FileCount(), 1u);
  run = shell("eval " + kHello + " --frames 0:3 -o a" + longest);
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_NE(run.err.find("File name too long"), std::string::npos) << run.err;
  // A pipe: without a reader, and with one
  run =
      RunShell("mkfifo pipe.npz; exec " KPSA_PROGRAM " eval " + kHello + " --frames 0:3 --force -o pipe.npz",
               60, folder.path());
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_NE(run.err.find("is a pipe that nobody reads"), std::string::npos) << run.err;
  run = RunShell(
      "cat pipe.npz > got.npz & exec " KPSA_PROGRAM " eval " + kHello + " --frames 0:3 --force -o pipe.npz",
      60, folder.path());
  EXPECT_EQ(run.exit_code, 0) << run.err;
  // Zero bytes, which end a text elsewhere
  folder.Write("rig.yaml", std::string("kpsa: 1\ncharacter: ") + kHelloGlb +
                               "\nnodes: {e: {type: expression, expression: \"1\\0+2\"}}\n");
  run = shell("get rig.yaml e.output --times 0");
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_NE(run.err.find("rig.yaml:3:"), std::string::npos) << run.err;
  EXPECT_NE(run.err.find("a text may hold no zero byte"), std::string::npos) << run.err;
}

#if !defined(KPSA_WITH_ASAN) && !defined(KPSA_WITH_TSAN)
TEST(Faults, MemoryIsLimitedWhereItIsAskedFor) {
  const TemporaryFolder folder;
  EXPECT_EQ(
      RunKpsa({"eval", kHello, "--frames", "0:10", "--max-memory", "2GB", "-o", folder / "a.npz"}).exit_code,
      0);
  // A small archive that claims gigabytes: two arrays of zeros, deflated
  const ProcessResult made = RunShell(
      "/usr/bin/python3 -c \"import numpy; numpy.savez_compressed('bomb.npz', a=numpy.zeros((1000, 100000, "
      "3), "
      "numpy.float32))\"",
      120, folder.path());
  if (made.exit_code != 0) GTEST_SKIP() << "no NumPy: " << made.err;
  ProcessResult run = RunKpsa({"inspect", folder / "bomb.npz"});
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_NE(run.err.find("claims 1200000128 bytes"), std::string::npos) << run.err;
  EXPECT_LT(run.peak_bytes, 300e6);
  run = RunKpsa({"compare", folder / "bomb.npz", folder / "bomb.npz", "--max-memory", "500MB"});
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_NE(run.err.find("not enough memory"), std::string::npos) << run.err;
  for (const char* wrong : {"2G", "", "-1GB", "10MB", "1e400GB", "GB"}) {
    run = RunKpsa({"inspect", folder / "bomb.npz", "--max-memory", wrong});
    EXPECT_EQ(run.exit_code, 2) << wrong;
    EXPECT_NE(run.err.find("expected a size from 64MB on"), std::string::npos) << wrong << run.err;
  }
}
#endif

TEST(Temporaries, AreRemovedWhereAProgramEndsAtOnce) {
  const TemporaryFolder folder;
  Result<OutputFile> kept = OutputFile::Create(folder / "kept", false),
                     left = OutputFile::Create(folder / "left", false);
  ASSERT_TRUE(kept.ok() && left.ok());
  EXPECT_EQ(folder.FileCount(), 2u);
  ASSERT_TRUE(kept->Commit().ok());
  RemoveTemporaries();
  EXPECT_EQ(folder.FileCount(), 1u);
  EXPECT_TRUE(std::filesystem::exists(folder / "kept"));
  // As many as are known, and beyond
  std::vector<OutputFile> many;
  for (int i = 0; i < kMostTemporaries + 3; ++i) {
    Result<OutputFile> one = OutputFile::Create(folder / ("file" + std::to_string(i)), false);
    ASSERT_TRUE(one.ok());
    many.push_back(std::move(*one));
  }
  many.clear();
  EXPECT_EQ(folder.FileCount(), 1u);
}

}  // namespace
}  // namespace kpsa::engine
