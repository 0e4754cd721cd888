#include "picture/decode.h"

#include <gtest/gtest.h>

#include "files/png.h"
#include "tests/support/png_bytes.h"

#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STB_IMAGE_WRITE_STATIC
#include <stb/stb_image_write.h>

namespace kpsa::engine {
namespace {

constexpr std::uint64_t kPlenty = 1 << 20;

std::string WhyNot(const std::vector<std::uint8_t>& bytes, std::uint64_t most = kPlenty) {
  const Result<Image> image = DecodePicture(bytes, most);
  return image.ok() ? "it decodes" : image.status().ToString();
}

std::vector<std::uint8_t> Ramp(int width, int height) {
  std::vector<std::uint8_t> rgb;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x)
      rgb.insert(rgb.end(), {static_cast<std::uint8_t>(255 * x / width),
                             static_cast<std::uint8_t>(255 * y / height), 90});
  }
  return rgb;
}

std::vector<std::uint8_t> Jpeg(int width, int height, int channels, const std::vector<std::uint8_t>& pixels) {
  std::vector<std::uint8_t> bytes;
  const auto append = [](void* to, void* data, int size) {
    const auto* from = static_cast<const std::uint8_t*>(data);
    static_cast<std::vector<std::uint8_t>*>(to)->insert(static_cast<std::vector<std::uint8_t>*>(to)->end(),
                                                        from, from + size);
  };
  stbi_write_jpg_to_func(append, &bytes, width, height, channels, pixels.data(), 95);
  return bytes;
}

TEST(Decode, PngOfEveryKind) {
  const std::vector<std::uint8_t> rgb = {255, 0, 10, 20, 30, 40};
  const auto pixels = [](const std::vector<std::uint8_t>& bytes) {
    const Result<Image> image = DecodePicture(bytes, kPlenty);
    EXPECT_TRUE(image.ok()) << image.status().ToString();
    return image.ok() ? image->rgb : std::vector<std::uint8_t>();
  };
  EXPECT_EQ(pixels(*EncodePng(2, 1, rgb)), rgb);
  EXPECT_EQ(pixels(MakePng(2, 1, 8, 2, rgb)), rgb);
  EXPECT_EQ(pixels(MakePng(2, 1, 8, 6, {255, 0, 10, 7, 20, 30, 40, 0})), rgb);  // alpha is not looked at
  EXPECT_EQ(pixels(MakePng(2, 1, 8, 0, {7, 200})), (std::vector<std::uint8_t>{7, 7, 7, 200, 200, 200}));
  EXPECT_EQ(pixels(MakePng(2, 1, 8, 4, {7, 1, 200, 2})), (std::vector<std::uint8_t>{7, 7, 7, 200, 200, 200}));
  EXPECT_EQ(pixels(MakePng(2, 1, 16, 0, {7, 7, 200, 200})),
            (std::vector<std::uint8_t>{7, 7, 7, 200, 200, 200}));
  EXPECT_EQ(pixels(MakePng(2, 1, 1, 0, {0x40})), (std::vector<std::uint8_t>{0, 0, 0, 255, 255, 255}));
  PngBytes palette, gamma;
  PutChunk("PLTE", {255, 0, 10, 20, 30, 40}, &palette);
  EXPECT_EQ(pixels(MakePng(2, 1, 8, 3, {0, 1}, palette)), rgb);
  PutChunk("gAMA", {0, 1, 0x86, 0xa0}, &gamma);  // 1.0; glTF wants colour profiles not to be looked at
  EXPECT_EQ(pixels(MakePng(2, 1, 8, 2, rgb, gamma)), rgb);
}

TEST(Decode, Jpeg) {
  const std::vector<std::uint8_t> ramp = Ramp(32, 24);
  const Result<Image> image = DecodePicture(Jpeg(32, 24, 3, ramp), kPlenty);
  ASSERT_TRUE(image.ok()) << image.status().ToString();
  ASSERT_EQ(image->width, 32);
  ASSERT_EQ(image->height, 24);
  for (std::size_t i = 0; i < ramp.size(); ++i) EXPECT_NEAR(image->rgb[i], ramp[i], 12) << i;
  const Result<Image> grey = DecodePicture(Jpeg(8, 8, 1, std::vector<std::uint8_t>(64, 77)), kPlenty);
  ASSERT_TRUE(grey.ok()) << grey.status().ToString();
  EXPECT_EQ(grey->At(4, 4), (Rgb{77, 77, 77}));
}

TEST(Decode, SizesAreLookedAtFirst) {
  const std::vector<std::uint8_t> small = *EncodePng(8, 8, Ramp(8, 8));
  EXPECT_EQ(WhyNot(small, 64), "it decodes");
  EXPECT_NE(WhyNot(small, 63).find("8 x 8 pixels; 63 are left"), std::string::npos) << WhyNot(small, 63);
  EXPECT_NE(WhyNot(MakePng(30000, 30000, 8, 2, {})).find("30000 x 30000"), std::string::npos);
  EXPECT_NE(WhyNot(MakePng(0x7fffffff, 1, 8, 2, {})).find("damaged PNG"), std::string::npos);
  EXPECT_NE(WhyNot(MakePng(0, 1, 8, 2, {})).find("damaged PNG"), std::string::npos);
  EXPECT_NE(WhyNot(Jpeg(32, 24, 3, Ramp(32, 24)), 700).find("32 x 24 pixels"), std::string::npos);
}

TEST(Decode, WhatIsCutOrUnknownIsAnError) {
  EXPECT_NE(WhyNot({}).find("neither PNG nor JPEG"), std::string::npos);
  EXPECT_NE(WhyNot({'G', 'I', 'F', '8', '9', 'a'}).find("neither PNG nor JPEG"), std::string::npos);
  const std::vector<std::uint8_t> png = *EncodePng(16, 12, Ramp(16, 12)),
                                  jpeg = Jpeg(16, 12, 3, Ramp(16, 12));
  for (const std::vector<std::uint8_t>* whole : {&png, &jpeg}) {
    for (std::size_t size = 0; size + 2 < whole->size(); ++size) {
      const std::string why = WhyNot({whole->begin(), whole->begin() + static_cast<std::ptrdiff_t>(size)});
      EXPECT_NE(why, "it decodes") << size << " of " << whole->size();
    }
  }
}

// Any byte may be wrong: an error, or other pixels; never more of them.
TEST(Decode, DamagedBytes) {
  const std::vector<std::uint8_t> png = *EncodePng(16, 12, Ramp(16, 12)),
                                  jpeg = Jpeg(16, 12, 3, Ramp(16, 12));
  int good = 0, bad = 0;
  for (const std::vector<std::uint8_t>* whole : {&png, &jpeg}) {
    for (std::size_t i = 0; i < whole->size(); ++i) {
      for (const int flip : {0x01, 0x80, 0xff}) {
        std::vector<std::uint8_t> bytes = *whole;
        bytes[i] ^= static_cast<std::uint8_t>(flip);
        const Result<Image> image = DecodePicture(bytes, 4096);
        ++(image.ok() ? good : bad);
        if (image.ok()) {
          EXPECT_LE(image->width * image->height, 4096);
        }
      }
    }
  }
  EXPECT_GT(good, 0);
  EXPECT_GT(bad, 0);
}

}  // namespace
}  // namespace kpsa::engine
