#include "picture/caption.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

namespace kpsa::engine {
namespace {

// Pixels of the lower third that are far brighter, or far darker, than a ground.
int Inked(const Image& image, int ground, int sign) {
  int count = 0;
  for (int y = image.height * 2 / 3; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) count += sign * (image.At(x, y)[1] - ground) > 150;
  }
  return count;
}

TEST(Captions, AreReadOnLightAndDarkGround) {
  const std::string text[] = {"head, talk, frame 12"};
  for (const int ground : {250, 20}) {
    const auto g = static_cast<std::uint8_t>(ground);
    Image image(200, 60, {g, g, g});
    DrawCaption(image, text);
    EXPECT_GT(Inked(image, ground, ground > 128 ? -1 : 1), 80) << ground;
    Image titled(200, 30, {g, g, g});
    DrawTitle(titled, text[0]);
    EXPECT_NE(titled.rgb, Image(200, 30, {g, g, g}).rgb);
  }
}

TEST(Captions, TheLongestThatFits) {
  const std::string texts[] = {"a very long name of a character, talk, frame 12", "frame 12", "12"};
  const auto draw = [&](int width, std::span<const std::string> choice) {
    Image image(width, 30, {255, 255, 255});
    DrawCaption(image, choice);
    return image.rgb;
  };
  const std::span<const std::string> all(texts);
  EXPECT_EQ(draw(400, all), draw(400, all.first(1)));
  EXPECT_EQ(draw(80, all), draw(80, all.subspan(1, 1)));
  EXPECT_EQ(draw(24, all), draw(24, all.subspan(2, 1)));
  EXPECT_EQ(draw(10, all), Image(10, 30, {255, 255, 255}).rgb);
  EXPECT_EQ(draw(10, {}), Image(10, 30, {255, 255, 255}).rgb);
}

TEST(Captions, TitlesShrinkUntilTheyFit) {
  const auto margins = [](const std::string& title) {
    const Rgb white = {255, 255, 255};
    Image image(300, 400, white);
    DrawTitle(image, title);
    int left = 300, right = 0, bottom = 0;
    for (int y = 0; y < 400; ++y) {
      for (int x = 0; x < 300; ++x) {
        if (image.At(x, y) == white) continue;
        left = std::min(left, x), right = std::max(right, x), bottom = std::max(bottom, y);
      }
    }
    return std::array{left, 299 - right, bottom};
  };
  const auto [left, right, bottom] = margins("full");
  const auto small = margins("170 key points and 1,234 scalars");
  EXPECT_GT(bottom, 20);
  EXPECT_LT(small[2], bottom);
  EXPECT_GT(small[0], 0);
  EXPECT_GT(small[1], 0);
  EXPECT_NEAR(left, right, 6);
}

TEST(Legends, MarkTheTolerance) {
  const Image bare = LegendPanel(300, {1e-3, 0}), marked = LegendPanel(300, {1e-3, 0.5e-3});
  EXPECT_EQ(bare.height, 300);
  ASSERT_EQ(bare.width, marked.width);
  // The first row of pixels that differs is the mark, in the middle of the bar; the words stand under it
  int first = -1, last = -1;
  for (int y = 0; y < 300; ++y) {
    for (int x = 0; x < bare.width; ++x) {
      if (bare.At(x, y) == marked.At(x, y)) continue;
      if (first < 0) first = y;
      last = y;
    }
  }
  EXPECT_NEAR(first, 150, 6);
  EXPECT_GT(last, 240);
  // A tolerance beyond the scale is said, and not marked on the bar
  const Image beyond = LegendPanel(300, {1e-3, 2e-3});
  EXPECT_NE(beyond.rgb, bare.rgb);
  for (int x = 12; x < 22; ++x) EXPECT_EQ(beyond.At(x, 60), bare.At(x, 60));
}

TEST(Legends, OfLightHavePlainNumbers) {
  EXPECT_NE(LegendPanel(300, {0.2, 0.05, false}).rgb, LegendPanel(300, {0.2, 0.05, true}).rgb);
}

}  // namespace
}  // namespace kpsa::engine
