// kpsa fmt.
#include "tests/cli/hello_folder.h"
#include "tests/cli/process.h"

namespace kpsa::engine {
namespace {

class Fmt : public ::testing::Test {
 protected:
  ProcessResult Run(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), "fmt");
    return RunKpsa(arguments);
  }
  HelloFolder folder;
};

TEST_F(Fmt, WritesWhereItIsTold) {
  const std::string text = folder.Yaml();
  const ProcessResult out = Run({folder.rig()});
  EXPECT_EQ(out.exit_code, 0) << out.err;
  const std::string first = text.substr(0, text.find('\n'));
  ASSERT_TRUE(first.starts_with("# "));
  EXPECT_NE(out.out.find(first), std::string::npos) << out.out;  // comments stay
  EXPECT_EQ(out.err, "");
  EXPECT_TRUE(Run({folder.rig(), "--drop-comments"})
                  .out.starts_with("kpsa: 1\nunits: {length: cm}\ncharacter: hello.glb\nnodes:\n  cage: {"));
  EXPECT_EQ(TemporaryFolder::Read(folder.rig()), text);
  EXPECT_EQ(Run({folder.rig(), "-q"}).err, "");
  EXPECT_EQ(Run({folder.rig(), "-o", folder / "new.yaml", "-q"}).exit_code, 0);
  EXPECT_EQ(TemporaryFolder::Read(folder / "new.yaml"), out.out);
  EXPECT_EQ(Run({folder.rig(), "-o", folder / "new.yaml"}).exit_code, 2) << "it exists";

  const ProcessResult differs = Run({folder / "new.yaml", folder.rig(), "--check"});
  EXPECT_EQ(differs.exit_code, 1) << differs.err;
  EXPECT_EQ(differs.out, folder.rig() + "\n");
  EXPECT_EQ(Run({folder.rig(), folder / "new.yaml", "--in-place"}).exit_code, 0);
  EXPECT_EQ(TemporaryFolder::Read(folder.rig()), out.out);
  EXPECT_EQ(Run({folder.rig(), folder / "new.yaml", "--check"}).exit_code, 0);

  // The same bytes
  const auto eval = [&](const std::string& rig, const std::string& to) {
    EXPECT_EQ(RunKpsa({"eval", rig, "--frames", "0:12:6", "-o", folder / to, "-q"}).exit_code, 0);
    return TemporaryFolder::Read(folder / to);
  };
  EXPECT_EQ(eval(kHello, "a.npz"), eval(folder.rig(), "b.npz"));
}

TEST_F(Fmt, RefusesWhatIsNoRig) {
  const std::string bad = folder.Edit("type: deltaMush", "type: deltaMash");
  const ProcessResult run = Run({bad, "--in-place", "--drop-comments"});
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_NE(run.err.find("hello.yaml:8:16: unknown node type \"deltaMash\""), std::string::npos) << run.err;
  EXPECT_NE(TemporaryFolder::Read(bad).find("deltaMash"), std::string::npos);
  // A part that others include is checked for what it is
  const std::string part = folder.Write("part.yaml", "kpsa: 1\noverrides: {mush.iterations: 3}\n");
  EXPECT_EQ(Run({part, "--check"}).exit_code, 1);
  EXPECT_EQ(Run({folder.Write("part.yaml", "kpsa: 1\noverides: {}\n")}).exit_code, 3);
  EXPECT_EQ(Run({folder / "hello.glb"}).exit_code, 2);
  EXPECT_EQ(Run({folder / "nobody.yaml"}).exit_code, 3);
  EXPECT_EQ(Run({part, part}).exit_code, 2);
  EXPECT_EQ(Run({part, "--check", "--in-place"}).exit_code, 2);
  EXPECT_EQ(Run({part, "-o", "a.yaml", "--in-place"}).exit_code, 2);
}

// Files that a rig names belong to it: one that is wrong is told, and the rest stays as it is written.
TEST_F(Fmt, ShapesOfFiles) {
  folder.Edit("nodes:\n",
              "nodes:\n  fix: {type: blendShape, targets: [{file: a b.obj, unit: cm, name: \"1\"}]}\n");
  folder.Edit("[skin, cage, mush]", "[skin, cage, mush, fix]");
  const ProcessResult missing = Run({folder.rig()});
  EXPECT_EQ(missing.exit_code, 3);
  EXPECT_NE(missing.err.find("a b.obj"), std::string::npos) << missing.err;
  std::string obj;
  for (int v = 0; v < 794; ++v) obj += "v 0 0 0\n";
  folder.Write("a b.obj", obj);
  const ProcessResult run = Run({folder.rig()});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("  fix: {type: blendShape, targets: [{file: a b.obj, unit: cm, name: \"1\"}]}\n"),
            std::string::npos)
      << run.out;
}

}  // namespace
}  // namespace kpsa::engine
