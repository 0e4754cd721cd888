#include "picture/texture.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "picture/picture.h"
#include "picture/surface.h"

namespace kpsa::engine {
namespace {

using gltf::Wrap;

constexpr Rgb kRed = {255, 0, 0}, kGreen = {0, 255, 0}, kBlue = {0, 0, 255}, kWhite = {255, 255, 255};

// red green / blue white
Image Four() {
  Image image(2, 2, kRed);
  image.Set(1, 0, kGreen), image.Set(0, 1, kBlue), image.Set(1, 1, kWhite);
  return image;
}

void ExpectColor(Double3 got, Double3 expected, double within = 1e-3) {
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(got[k], expected[k], within) << k;
}

TEST(Texture, TheUpperLeftCornerIsZero) {
  const Texture texture(Four());
  const auto at = [&](double u, double v) { return texture.At(u, v, 0, Wrap::kRepeat, Wrap::kRepeat, true); };
  ExpectColor(at(0.1, 0.1), {1, 0, 0});
  ExpectColor(at(0.9, 0.1), {0, 1, 0});
  ExpectColor(at(0.1, 0.9), {0, 0, 1});
  ExpectColor(at(0.9, 0.9), {1, 1, 1});
  ExpectColor(at(std::numeric_limits<double>::quiet_NaN(), 0), {0, 0, 0});
}

TEST(Texture, WrapsAsTheSamplerSays) {
  const Texture texture(Four());
  const auto at = [&](double u, Wrap wrap) { return texture.At(u, 0.1, 0, wrap, Wrap::kClamp, true); };
  ExpectColor(at(1.1, Wrap::kRepeat), {1, 0, 0});
  ExpectColor(at(-0.1, Wrap::kRepeat), {0, 1, 0});
  ExpectColor(at(1.1, Wrap::kMirror), {0, 1, 0});
  ExpectColor(at(1.9, Wrap::kMirror), {1, 0, 0});
  ExpectColor(at(-0.1, Wrap::kMirror), {1, 0, 0});
  ExpectColor(at(-0.9, Wrap::kMirror), {0, 1, 0});
  ExpectColor(at(2.1, Wrap::kMirror), {1, 0, 0});
  ExpectColor(at(9, Wrap::kClamp), {0, 1, 0});
  ExpectColor(at(-9, Wrap::kClamp), {1, 0, 0});
  for (const double far : {1e18, -1e18, 1e300, -1e300}) {
    for (const Wrap wrap : {Wrap::kRepeat, Wrap::kMirror, Wrap::kClamp}) {
      const Double3 color = at(far, wrap);
      EXPECT_NEAR(color.x + color.y, 1, 1e-3) << far;
    }
  }
  // Interpolated across the border: halfway between the last texel and the first
  ExpectColor(texture.At(1, 0.25, 0, Wrap::kRepeat, Wrap::kRepeat, false), {0.5, 0.5, 0});
  ExpectColor(texture.At(1, 0.25, 0, Wrap::kClamp, Wrap::kRepeat, false), {0, 1, 0});
}

TEST(Texture, IsDecodedAndAveragedInLinearLight) {
  const Texture grey(Image(4, 4, {188, 188, 188}));
  EXPECT_NEAR(grey.At(0.3, 0.6, 1, Wrap::kRepeat, Wrap::kRepeat, false).x, 0.5, 0.01);  // IEC 61966-2-1
  const Texture four(Four());
  ExpectColor(four.At(0.5, 0.5, 0, Wrap::kRepeat, Wrap::kRepeat, false), {0.5, 0.5, 0.5});
  ExpectColor(four.At(0.1, 0.1, 2, Wrap::kRepeat, Wrap::kRepeat, true), {0.5, 0.5, 0.5}, 0.01);
  ExpectColor(four.At(0.1, 0.1, 1e30, Wrap::kRepeat, Wrap::kRepeat, true), {0.5, 0.5, 0.5}, 0.01);
  // Fine stripes seen from afar are grey, whatever the size of the picture
  Image stripes(37, 5, {0, 0, 0});
  for (int x = 0; x < 37; x += 2) {
    for (int y = 0; y < 5; ++y) stripes.Set(x, y, kWhite);
  }
  const Double3 far = Texture(std::move(stripes)).At(0.4, 0.4, 37, Wrap::kRepeat, Wrap::kRepeat, false);
  EXPECT_NEAR(far.x, 0.5, 0.06);
}

// A square from -1 to 1, two triangles, and its picture, 80 by 80, that it fills to the middle half.
struct Covered {
  std::vector<float> points = {-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0}, uvs = {0, 1, 1, 1, 1, 0, 0, 0};
  std::vector<Index> triangles = {0, 1, 2, 0, 2, 3}, texture = {0, 0, 0, 0};
  std::vector<SurfaceTexture> textures;
  std::vector<float> scalars;
  Double3 color = {1, 1, 1};
  RenderInput Input() const {
    RenderInput input;
    RenderPart& part = input.parts.emplace_back();
    part.points = points, part.triangles = triangles, part.color = color, part.scalars = scalars;
    part.textures = textures, part.texture = texture, part.uvs = uvs;
    return input;
  }
  Image Draw() const {
    Camera camera;
    camera.eye = {0, 0, 10};
    camera.field_of_view = 2 * std::atan(2.0 / 10);
    RenderOptions options;
    options.width = options.height = 80;
    const Result<Image> image = RenderMesh(Input(), camera, options);
    EXPECT_TRUE(image.ok()) << image.status().ToString();
    return image.ok() ? *image : Image(80, 80, {0, 0, 0});
  }
};

TEST(TexturedPicture, IsMultipliedWithTheColourAndHiddenByScalars) {
  Covered square;
  square.textures = {{std::make_shared<const Texture>(Four()), Wrap::kClamp, Wrap::kClamp, true}};
  const Image image = square.Draw();
  // 20 pixels a texel; its light is nearly white
  EXPECT_GT(image.At(30, 30)[0], 150);
  EXPECT_LT(image.At(30, 30)[1], 90);
  EXPECT_GT(image.At(50, 30)[1], 150);
  EXPECT_LT(image.At(50, 30)[2], 90);
  EXPECT_GT(image.At(30, 50)[2], 150);
  EXPECT_LT(image.At(30, 50)[0], 90);
  // White times a colour is that colour without a texture
  Covered colored = square, plain = square;
  colored.color = plain.color = {0.2, 0.5, 0.9};
  plain.textures.clear(), plain.texture.clear(), plain.uvs.clear();
  const Image with = colored.Draw(), without = plain.Draw();
  EXPECT_EQ(with.At(50, 50), without.At(50, 50));
  EXPECT_EQ(with.At(5, 5), without.At(5, 5));
  EXPECT_NE(with.At(30, 30), without.At(30, 30));
  square.scalars = plain.scalars = std::vector<float>(4, 0.5e-3f);
  EXPECT_EQ(square.Draw().rgb, plain.Draw().rgb);
}

TEST(TexturedPicture, FineTexturesDoNotFlicker) {
  Covered square;
  Image checks(512, 512, {0, 0, 0});
  for (int y = 0; y < 512; ++y) {
    for (int x = y % 2; x < 512; x += 2) checks.Set(x, y, kWhite);
  }
  square.textures = {{std::make_shared<const Texture>(std::move(checks))}};
  const Image image = square.Draw();
  int low = 255, high = 0;
  for (int y = 25; y < 55; ++y) {
    for (int x = 25; x < 55; ++x)
      low = std::min<int>(low, image.At(x, y)[1]), high = std::max<int>(high, image.At(x, y)[1]);
  }
  EXPECT_LT(high - low, 12);
}

TEST(TexturedPicture, SpansOfWrongLengthsAreErrors) {
  Covered square;
  square.textures = {{std::make_shared<const Texture>(Four())}};
  RenderInput input = square.Input();
  const auto refused = [&] { return !GatherSurface(input).ok(); };
  EXPECT_FALSE(refused());
  input.parts[0].uvs = input.parts[0].uvs.first(6);
  EXPECT_TRUE(refused());
  input = square.Input();
  square.texture = {0, 0, 1, 0};
  input.parts[0].texture = square.texture;
  EXPECT_TRUE(refused());
  const std::vector<Index> far = {0, 1, 2, 4};
  input.parts[0].texture = {}, input.parts[0].uvs = {};
  EXPECT_FALSE(refused());
  input.parts[0].smooth = far;
  EXPECT_TRUE(refused());
}

}  // namespace
}  // namespace kpsa::engine
