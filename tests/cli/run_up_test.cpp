// Nodes that remember their previous frame: a frame has the points that it has in the whole clip, wherever a
// command begins.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "files/npz.h"
#include "tests/cli/hello_folder.h"
#include "tests/cli/process.h"

namespace kpsa::engine {
namespace {

class RunUpOfCommands : public ::testing::Test {
 protected:
  RunUpOfCommands() {
    folder_.Edit("  mush: {type: deltaMush, iterations: 10}\n",
                 "  mush: {type: deltaMush, iterations: 10}\n"
                 "  lag: {type: jiggle, stiffness: 0.2, damping: 0.1}\n");
    folder_.Edit("stack: [skin, cage, mush]", "stack: [skin, cage, mush, lag]");
  }
  // The points of the column, a frame each.
  std::vector<std::vector<float>> Eval(const std::vector<std::string>& flags) const {
    std::vector<std::string> arguments{"eval", "hello.yaml", "--clip", "wave", "-o", "out.npz", "--force"};
    arguments.insert(arguments.end(), flags.begin(), flags.end());
    const ProcessResult run = RunKpsa(arguments, 60, folder_.path());
    EXPECT_EQ(run.exit_code, 0) << run.err;
    const Result<Npz> npz = ReadNpz(folder_ / "out.npz");
    EXPECT_TRUE(npz.ok()) << npz.status().ToString();
    if (!npz.ok()) return {};
    std::vector<std::vector<float>> frames;
    for (const NpzArray& array : npz->arrays) {
      if (array.shape.size() != 3) continue;
      const std::vector<float> all = array.Floats();
      const std::size_t size = array.shape[1] * array.shape[2];
      for (std::size_t at = 0; at < all.size(); at += size)
        frames.emplace_back(all.begin() + static_cast<std::ptrdiff_t>(at),
                            all.begin() + static_cast<std::ptrdiff_t>(at + size));
    }
    return frames;
  }
  const HelloFolder folder_;
};

TEST_F(RunUpOfCommands, FramesAreThoseOfTheWholeClip) {
  const std::vector<std::vector<float>> all = Eval({"--frames", "0:20"});
  ASSERT_EQ(all.size(), 21u);
  using Frames = std::vector<std::vector<float>>;
  EXPECT_EQ(Eval({"--frames", "12:14"}), (Frames{all[12], all[13], all[14]}));
  EXPECT_EQ(Eval({"--frames", "3:15:6"}), (Frames{all[3], all[9], all[15]}));
  EXPECT_EQ(Eval({"--frames", "-2:1"})[3], all[1]);
  const Frames timed = Eval({"--fps", "20", "--times", "0.5,0.27,0.25"}),
               twenty = Eval({"--fps", "20", "--frames", "0:10"});
  ASSERT_EQ(timed.size(), 3u);
  EXPECT_EQ(timed[0], twenty[10]);
  EXPECT_EQ(timed[2], twenty[5]) << "after a time between frames";
  EXPECT_NE(Eval({"--frames", "12", "--set", "lag.envelope=0"})[0], all[12]) << "it lags";
}

}  // namespace
}  // namespace kpsa::engine
