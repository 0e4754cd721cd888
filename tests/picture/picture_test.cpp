#include "picture/picture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "base/parallel.h"
#include "picture/caption.h"
#include "scenes/glb_writer.h"
#include "scenes/head_shape.h"

namespace kpsa::engine {
namespace {

struct Mesh {
  std::vector<float> points;
  std::vector<Index> triangles;
  RenderPart Part() const {
    RenderPart part;
    part.points = points;
    part.triangles = triangles;
    return part;
  }
};

const Mesh& Head() {
  static const Mesh head = [] {
    const scenes::HeadShape shape = scenes::MakeHeadShape(scenes::FaceDesign());
    Mesh mesh;
    for (const Double3& p : shape.points) {
      for (int axis = 0; axis < 3; ++axis) mesh.points.push_back(static_cast<float>(p[axis] * 0.01));
    }
    mesh.triangles = scenes::Triangulate(shape.quads);
    return mesh;
  }();
  return head;
}

// A square of side 2 in the plane z = 0, seen from +z.
Mesh Square() { return {{-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0}, {0, 1, 2, 0, 2, 3}}; }

// Sees 4 by 4 at the square, which fills the middle half.
Camera InFrontOfTheSquare() {
  Camera camera;
  camera.eye = {0, 0, 10};
  camera.field_of_view = 2 * std::atan(2.0 / 10);
  return camera;
}

RenderOptions Plain(int width, int height) {
  RenderOptions options;
  options.width = width;
  options.height = height;
  options.background_top = options.background_bottom = {0, 0, 255};
  return options;
}

bool IsGround(Rgb c) { return c == Rgb{0, 0, 255}; }

TEST(Picture, ASquareCoversItsPixelsAndNoOthers) {
  const Mesh square = Square();
  RenderInput input;
  input.parts = {square.Part()};
  const Camera camera = InFrontOfTheSquare();
  const auto image = RenderMesh(input, camera, Plain(80, 80));
  ASSERT_TRUE(image.ok());
  for (int y = 0; y < 80; ++y) {
    for (int x = 0; x < 80; ++x) {
      const bool inside = x >= 21 && x < 59 && y >= 21 && y < 59,
                 outside = x < 19 || x > 60 || y < 19 || y > 60;
      if (inside || outside) {
        EXPECT_EQ(IsGround(image->At(x, y)), outside) << x << " " << y;
      }
    }
  }
}

TEST(Picture, TheHeadFromTheFrontIsFramedAndSymmetric) {
  RenderInput input;
  input.parts = {Head().Part()};
  const RenderOptions options = Plain(200, 260);
  const auto image = RenderMesh(input, FrameCamera(input, options, 0, 0), options);
  ASSERT_TRUE(image.ok());
  int covered = 0, asymmetric = 0, border = 0;
  for (int y = 0; y < options.height; ++y) {
    for (int x = 0; x < options.width; ++x) {
      const bool ground = IsGround(image->At(x, y));
      covered += !ground;
      asymmetric += ground != IsGround(image->At(options.width - 1 - x, y));
      border += !ground && (x == 0 || y == 0 || x == options.width - 1 || y == options.height - 1);
    }
  }
  EXPECT_GT(covered, options.width * options.height / 4);
  EXPECT_LT(covered, options.width * options.height * 3 / 4);
  EXPECT_LE(asymmetric, covered / 200);
  EXPECT_EQ(border, 0);
}

TEST(Picture, IsTheSameWithOneThreadAndMany) {
  RenderInput input;
  input.parts = {Head().Part()};
  const RenderOptions options = Plain(90, 110);
  const Camera camera = FrameCamera(input, options, 0.6, 0.1);
  const auto many = RenderMesh(input, camera, options);
  const ThreadLimit limit(1);
  const auto one = RenderMesh(input, camera, options);
  ASSERT_TRUE(many.ok() && one.ok());
  EXPECT_EQ(many->rgb, one->rgb);
}

TEST(Picture, ACoveredPlaceIsDarker) {
  Mesh scene = Square();
  // A lid over the right half, just above it; only the sky and the key light change below
  for (float v : {0.2f, -1.f, 0.15f, 1.f, -1.f, 0.15f, 1.f, 1.f, 0.15f, 0.2f, 1.f, 0.15f})
    scene.points.push_back(v);
  RenderInput open, covered;
  const Mesh square = Square();
  open.parts = {square.Part()};
  scene.triangles.insert(scene.triangles.end(), {4, 5, 6, 4, 6, 7});
  covered.parts = {scene.Part()};
  Camera camera;
  camera.eye = {-6, 0, 3};
  camera.target = {0, 0, 0};
  camera.up = {0, 0, 1};
  const RenderOptions options = Plain(60, 60);
  const auto before = RenderMesh(open, camera, options), after = RenderMesh(covered, camera, options);
  ASSERT_TRUE(before.ok() && after.ok());
  EXPECT_LT(after->At(30, 30)[1], before->At(30, 30)[1]);
}

TEST(Picture, HeatMapsGoFromBlueToRed) {
  const Mesh square = Square();
  const std::vector<float> low(4, 0.05e-3f), high(4, 0.9e-3f);
  RenderInput input;
  input.parts = {square.Part()};
  Camera camera;
  camera.eye = {0, 0, 10};
  input.parts[0].scalars = low;
  const auto cold = RenderMesh(input, camera, Plain(20, 20));
  input.parts[0].scalars = high;
  const auto hot = RenderMesh(input, camera, Plain(20, 20));
  ASSERT_TRUE(cold.ok() && hot.ok());
  EXPECT_GT(cold->At(10, 10)[2], cold->At(10, 10)[0]);
  EXPECT_GT(hot->At(10, 10)[0], hot->At(10, 10)[2]);
}

TEST(Picture, AComparisonShowsThreePicturesAndTheLargestError) {
  const Mesh& head = Head();
  std::vector<float> moved = head.points;
  moved[3 * 100] += 0.8e-3f;
  RenderInput full, accelerated;
  full.parts = {head.Part()};
  accelerated.parts = {head.Part()};
  accelerated.parts[0].points = moved;
  const RenderOptions options = Plain(120, 150);
  const auto image = RenderComparison(full, accelerated, FrameCamera(full, options, 0, 0), options);
  ASSERT_TRUE(image.ok());
  EXPECT_EQ(image->width, 3 * 120 + 3 * 4 + LegendPanel(150, {}).width);
  EXPECT_EQ(image->height, 150);
  const std::vector<float> distances = PointDistances(head.points, moved);
  EXPECT_NEAR(*std::max_element(distances.begin(), distances.end()), 0.8e-3, 1e-7);
  EXPECT_EQ(std::count(distances.begin(), distances.end(), 0.0f),
            static_cast<std::ptrdiff_t>(distances.size()) - 1);
  accelerated.parts[0].points = std::span(moved).first(moved.size() - 3);
  EXPECT_FALSE(RenderComparison(full, accelerated, {}, options).ok());
}

TEST(Picture, AComparisonShowsKeyPointsOnRequest) {
  const Mesh square = Square();
  RenderInput full;
  full.parts = {square.Part()};
  const Camera camera = InFrontOfTheSquare();
  const RenderOptions options = Plain(480, 480);
  RenderDots dots{"2 key points",
                  {0.5f, 0.5f, 0, -0.5f, -0.5f, -0.5f}};  // the second one is behind the square
  const auto image = RenderComparison(full, full, camera, options, &dots);
  ASSERT_TRUE(image.ok());
  ASSERT_EQ(image->width, 4 * 480 + 4 * 4 + LegendPanel(480, {}).width);
  const auto reds = [&](int left) {
    int count = 0;
    double x = 0, y = 0;
    for (int row = 20; row < 480; ++row) {
      for (int column = left; column < left + 480; ++column) {
        const Rgb c = image->At(column, row);
        if (c[0] < 100 || c[0] < 2 * c[1]) continue;
        ++count, x += column - left, y += row;
      }
    }
    return std::array<double, 3>{static_cast<double>(count), x / std::max(1, count), y / std::max(1, count)};
  };
  EXPECT_EQ(reds(0)[0], 0);
  EXPECT_EQ(reds(2 * 484)[0], 0);
  const std::array<double, 3> seen = reds(484);
  EXPECT_GT(seen[0], 1);
  EXPECT_LT(seen[0], 30);
  EXPECT_NEAR(seen[1], 300, 2);
  EXPECT_NEAR(seen[2], 180, 2);
  // Every ball is closed: its edges go both ways once
  const RenderPart balls = MakeDots(dots, 0.1);
  std::map<std::pair<Index, Index>, int> edges;
  for (std::size_t t = 0; t < balls.triangles.size(); t += 3) {
    for (std::size_t k = 0; k < 3; ++k) ++edges[{balls.triangles[t + k], balls.triangles[t + (k + 1) % 3]}];
  }
  for (const auto& [edge, count] : edges) {
    EXPECT_EQ(count, 1);
    EXPECT_EQ(edges.count({edge.second, edge.first}), 1u);
  }
  for (std::size_t i = 0; i < balls.points.size(); i += 3) {
    const std::size_t d = i < balls.points.size() / 2 ? 0 : 3;
    const double x = double{balls.points[i]} - dots.points[d],
                 y = double{balls.points[i + 1]} - dots.points[d + 1],
                 z = double{balls.points[i + 2]} - dots.points[d + 2];
    EXPECT_NEAR(std::sqrt(x * x + y * y + z * z), 0.1, 1e-6);
  }
}

TEST(Picture, KeyPointsCastNoShadows) {
  const Mesh square = Square();
  RenderInput full;
  full.parts = {square.Part()};
  const Camera camera = InFrontOfTheSquare();
  const RenderDots dots{"1 key point", {-1, 1, 0}};  // at a corner, whose light two triangles share
  const auto image = RenderComparison(full, full, camera, Plain(120, 120), &dots);
  ASSERT_TRUE(image.ok());
  int differ = 0, near = 0;
  for (int y = 24; y < 120; ++y) {  // below the titles
    for (int x = 0; x < 120; ++x) {
      if (image->At(x, y) == image->At(x + 124, y)) continue;
      ++(std::hypot(x - 30, y - 30) < 4 ? near : differ);
    }
  }
  EXPECT_EQ(differ, 0);
  EXPECT_GT(near, 0);
  // The canary: a ball that casts its shadow is seen all over the triangles
  RenderInput lit = full, dark = full;
  lit.parts.push_back(MakeDots(dots, 0.02));
  dark.parts.push_back(MakeDots(dots, 0.02));
  dark.parts.back().casts_shadows = true;
  const auto light = RenderMesh(lit, camera, Plain(120, 120)),
             shade = RenderMesh(dark, camera, Plain(120, 120));
  ASSERT_TRUE(light.ok() && shade.ok());
  EXPECT_LT(shade->At(40, 40)[1], light->At(40, 40)[1]);
}

TEST(Picture, ATurntableStartsInFrontAndTurns) {
  RenderInput input;
  input.parts = {Head().Part()};
  const RenderOptions options = Plain(60, 80);
  const auto frames = RenderTurntable(input, 4, 0.1, options);
  ASSERT_TRUE(frames.ok());
  ASSERT_EQ(frames->size(), 4u);
  const std::vector<Camera> cameras = FrameAround(input, options, 4, 0.1);
  EXPECT_EQ((*frames)[0].rgb, RenderMesh(input, cameras[0], options)->rgb);
  // All at one scale: what turns is as large from every side
  for (const Camera& camera : cameras) {
    EXPECT_NEAR(Length(camera.eye - camera.target), Length(cameras[0].eye - cameras[0].target), 1e-9);
    EXPECT_EQ(Length(camera.target - cameras[0].target), 0);
  }
  EXPECT_NE((*frames)[0].rgb, (*frames)[2].rgb);
}

TEST(Picture, RefusesWhatCannotBeDrawn) {
  const Mesh square = Square();
  RenderInput input;
  input.parts = {square.Part()};
  EXPECT_FALSE(RenderMesh(input, {}, Plain(0, 10)).ok());
  EXPECT_FALSE(RenderMesh(input, {}, Plain(10, 100000)).ok());
  const std::vector<float> scalars(3);
  input.parts[0].scalars = scalars;
  EXPECT_FALSE(RenderMesh(input, {}, Plain(10, 10)).ok());
  input.parts[0].scalars = {};
  const std::vector<Index> far = {0, 1, 9};
  input.parts[0].triangles = far;
  EXPECT_FALSE(RenderMesh(input, {}, Plain(10, 10)).ok());
}

TEST(Image, TextInksTheBoxThatItClaims) {
  Image image(120, 30, {255, 255, 255});
  DrawText(image, 5, 5, 2, {0, 0, 0}, "0.12 mm");
  const int width = TextWidth("0.12 mm", 2);
  int inside = 0, outside = 0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      if (image.At(x, y)[0] != 0) continue;
      const bool in = x >= 5 && x < 5 + width && y >= 5 && y < 5 + 2 * 12;
      (in ? inside : outside) += 1;
    }
  }
  EXPECT_GT(inside, 100);
  EXPECT_EQ(outside, 0);
  DrawText(image, 115, 25, 3, {0, 0, 0}, std::string(5000, 'W') + "\n\xff");  // clipped, whatever it is
}

TEST(Image, SideBySideKeepsThePixels) {
  const std::vector<Image> images = {Image(3, 2, {1, 2, 3}), Image(2, 4, {4, 5, 6})};
  const Image both = SideBySide(images, 1);
  EXPECT_EQ(both.width, 6);
  EXPECT_EQ(both.height, 4);
  EXPECT_EQ(both.At(2, 1), (Rgb{1, 2, 3}));
  EXPECT_EQ(both.At(4, 3), (Rgb{4, 5, 6}));
  EXPECT_EQ(SideBySide({}).width, 0);
}

TEST(Image, ShrunkPixelsAreMeans) {
  Image image(5, 4, {9, 9, 9});
  image.Fill(0, 0, 2, 2, {10, 20, 255});
  image.Set(1, 1, {11, 22, 0});
  image.Fill(4, 0, 1, 4, {200, 200, 200});  // left over
  const Image small = Shrunk(image, 2);
  EXPECT_EQ(small.width, 2);
  EXPECT_EQ(small.height, 2);
  EXPECT_EQ(small.At(0, 0), (Rgb{10, 21, 191}));
  EXPECT_EQ(small.At(1, 1), (Rgb{9, 9, 9}));
  EXPECT_EQ(Shrunk(image, 1).rgb, image.rgb);
}

TEST(Image, LengthsKeepThreeDigits) {
  EXPECT_EQ(Millimetres(0), "0.000 mm");
  EXPECT_EQ(Millimetres(0.000213), "0.213 mm");
  EXPECT_EQ(Millimetres(0.0123), "12.3 mm");
  EXPECT_EQ(Millimetres(1.5), "1500 mm");
}

}  // namespace
}  // namespace kpsa::engine
