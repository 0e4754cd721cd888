// kpsa graph draws parts of a rig; what is said of a plug that is none; kpsa help.
#include <gtest/gtest.h>

#include "tests/cli/process.h"

namespace kpsa::engine {
namespace {

std::string Draw(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), {"graph", kHello});
  const ProcessResult run = RunKpsa(arguments);
  EXPECT_EQ(run.exit_code, 0) << run.err;
  return run.out;
}

bool Shows(const std::string& drawing, const std::string& node) {
  return drawing.find("label=\"" + node + "\\n") != std::string::npos;
}

std::size_t Boxes(const std::string& drawing) {
  std::size_t count = 0;
  for (std::size_t at = drawing.find("[label="); at != std::string::npos;
       at = drawing.find("[label=", at + 1))
    ++count;
  return count;
}

TEST(GraphParts, KindsOfNodesAreHidden) {
  const std::string all = Draw({});
  ASSERT_TRUE(Shows(all, "upper") && Shows(all, "mush") && Shows(all, "squeeze"));
  const std::string bare = Draw({"--hide", "joints,clips,deltaMush"});
  EXPECT_FALSE(Shows(bare, "upper"));
  EXPECT_FALSE(Shows(bare, "mush"));
  EXPECT_TRUE(Shows(bare, "squeeze"));
  // Nor are arrows from or to them drawn
  EXPECT_EQ(bare.find("worldMatrix > "), std::string::npos) << bare;
  const ProcessResult wrong = RunKpsa({"graph", kHello, "--hide", "joinst"});
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_NE(wrong.err.find("did you mean \"joints\""), std::string::npos) << wrong.err;
}

TEST(GraphParts, TheNeighbourhoodOfANode) {
  const std::string near = Draw({"--around", "squeeze"}), nearer = Draw({"--around", "squeeze:0"}),
                    far = Draw({"--around", "squeeze:3"});
  EXPECT_EQ(Boxes(nearer), 1u);
  EXPECT_TRUE(Shows(near, "squeeze"));
  EXPECT_TRUE(Shows(near, "cage"));
  EXPECT_FALSE(Shows(near, "mush"));
  EXPECT_GT(Boxes(far), Boxes(near));
  EXPECT_TRUE(Shows(far, "mush"));
  // What is hidden leads nowhere
  EXPECT_LT(Boxes(Draw({"--around", "squeeze:3", "--hide", "lattice"})), Boxes(far) - 1);
  const ProcessResult wrong = RunKpsa({"graph", kHello, "--around", "squeese:2"});
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_NE(wrong.err.find("did you mean \"squeeze\""), std::string::npos) << wrong.err;
  EXPECT_EQ(RunKpsa({"graph", kHello, "--around", "squeeze:-1"}).exit_code, 2);
  EXPECT_EQ(RunKpsa({"graph", kHello, "--around", "squeeze:99999999999"}).exit_code, 2);
}

TEST(WrongPlugs, NearAttributesAreNamedOrAllOfThem) {
  const auto says = [](const std::string& setting) {
    return RunKpsa({"eval", kHello, "-o", "a.npz", "--set", setting}).err;
  };
  EXPECT_NE(says("upper.rotatex=1").find("(did you mean \"rotateX\"?)"), std::string::npos)
      << says("upper.rotatex=1");
  EXPECT_NE(says("upper.rotateW=1").find("\"rotateX\", \"rotateY\" or \"rotateZ\""), std::string::npos)
      << says("upper.rotateW=1");
  const std::string list = says("upper.bananas=1");
  EXPECT_NE(list.find("there is "), std::string::npos) << list;
  EXPECT_NE(list.find("translate, "), std::string::npos) << list;
  EXPECT_NE(list.find(" more"), std::string::npos) << list;
}

TEST(Help, OfACommandInTwoWays) {
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"eval"}, {"weights", "import"}, {"weights"}, {}}) {
    std::vector<std::string> help = command, option = command;
    help.insert(help.begin(), "help");
    option.push_back("--help");
    const ProcessResult a = RunKpsa(help), b = RunKpsa(option);
    EXPECT_EQ(a.exit_code, 0) << a.err;
    EXPECT_EQ(a.out, b.out);
    EXPECT_FALSE(a.out.empty());
  }
  EXPECT_NE(RunKpsa({"help", "--help"}).out.find("The help of a command"), std::string::npos);
  const ProcessResult wrong = RunKpsa({"help", "evla"});
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_NE(wrong.err.find("did you mean \"eval\""), std::string::npos) << wrong.err;
}

}  // namespace
}  // namespace kpsa::engine
