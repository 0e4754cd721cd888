#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "host/checks/playback_times.h"

namespace kpsa::engine {
namespace {

TEST(PlaybackBlocks, AreSpreadOverTheFramesOfAllClips) {
  using Blocks = std::vector<PlaybackBlock>;
  const auto blocks = [](const std::vector<std::size_t>& lengths, std::size_t count, std::size_t frames) {
    std::vector<TrainingClip> clips;
    for (const std::size_t length : lengths) clips.push_back({"clip", std::vector<double>(length)});
    return PlaybackBlocks(clips, count, frames);
  };
  EXPECT_EQ(blocks({100}, 2, 8), (Blocks{{0, 21, 30}, {0, 71, 80}}));
  EXPECT_EQ(blocks({50, 150}, 4, 2), (Blocks{{0, 24, 27}, {1, 24, 27}, {1, 74, 77}, {1, 124, 127}}));
  EXPECT_EQ(blocks({5}, 5, 8), (Blocks{{0, 0, 5}})) << "no frame counts twice";
  EXPECT_EQ(blocks({12}, 2, 8), (Blocks{{0, 0, 9}, {0, 8, 12}}));
  EXPECT_EQ(blocks({1, 1}, 2, 8), Blocks()) << "nothing leads in";
  EXPECT_EQ(blocks({}, 2, 8), Blocks());
}

}  // namespace
}  // namespace kpsa::engine
