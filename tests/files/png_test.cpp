#include "files/png.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_ONLY_PNG
#include <stb/stb_image.h>

namespace kpsa::engine {
namespace {

std::vector<std::uint8_t> Pattern(int width, int height) {
  std::vector<std::uint8_t> rgb;
  for (int i = 0; i < width * height * 3; ++i) rgb.push_back(static_cast<std::uint8_t>(i * 37 + i / 11));
  return rgb;
}

class PngFolder : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("kpsa_png_" + std::to_string(getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::filesystem::path folder_;
};

TEST(Png, DecodesToTheSamePixels) {
  for (const auto& [width, height] : {std::pair{1, 1}, {7, 3}, {64, 48}}) {
    const std::vector<std::uint8_t> rgb = Pattern(width, height);
    const auto bytes = EncodePng(width, height, rgb);
    ASSERT_TRUE(bytes.ok());
    int w = 0, h = 0, channels = 0;
    std::uint8_t* pixels =
        stbi_load_from_memory(bytes->data(), static_cast<int>(bytes->size()), &w, &h, &channels, 0);
    ASSERT_NE(pixels, nullptr);
    EXPECT_EQ(w, width);
    EXPECT_EQ(h, height);
    EXPECT_EQ(channels, 3);
    EXPECT_EQ(std::vector<std::uint8_t>(pixels, pixels + rgb.size()), rgb);
    stbi_image_free(pixels);
  }
}

TEST(Png, RefusesSizesThatDoNotFitThePixels) {
  EXPECT_FALSE(EncodePng(0, 4, {}).ok());
  EXPECT_FALSE(EncodePng(-1, -1, Pattern(1, 1)).ok());
  EXPECT_FALSE(EncodePng(40000, 1, Pattern(1, 1)).ok());
  EXPECT_FALSE(EncodePng(32768, 32768, Pattern(1, 1)).ok());
  EXPECT_NE(EncodePng(2, 2, Pattern(1, 1)).status().ToString().find("needs 12 bytes, there are 3"),
            std::string::npos);
}

TEST_F(PngFolder, IsWrittenWholeAndLeavesNothingBeside) {
  const std::string path = folder_ / "a.png";
  ASSERT_TRUE(WritePng(path, false, 5, 4, Pattern(5, 4)).ok());
  EXPECT_FALSE(WritePng(path, false, 3, 2, Pattern(3, 2)).ok());
  ASSERT_TRUE(WritePng(path, true, 3, 2, Pattern(3, 2)).ok());
  std::ifstream in(path, std::ios::binary);
  const std::vector<std::uint8_t> bytes((std::istreambuf_iterator<char>(in)), {});
  EXPECT_EQ(bytes, *EncodePng(3, 2, Pattern(3, 2)));
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_), {}), 1);
}

TEST_F(PngFolder, SaysWhereItCannotWrite) {
  const Status status = WritePng(folder_ / "missing" / "a.png", true, 1, 1, Pattern(1, 1));
  EXPECT_FALSE(status.ok());
  EXPECT_NE(status.ToString().find("missing/a.png"), std::string::npos);
  const Status onto_folder = WritePng(folder_, true, 1, 1, Pattern(1, 1));
  EXPECT_FALSE(onto_folder.ok());
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

}  // namespace
}  // namespace kpsa::engine
