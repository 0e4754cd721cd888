// Pictures side by side, and what they show beside the shape (picture/picture.h).
#include <algorithm>
#include <memory>
#include <utility>

#include "base/check.h"
#include "picture/caption.h"
#include "picture/picture.h"
#include "picture/surface.h"

namespace kpsa::engine {
namespace {

constexpr double kDotRadius = 0.006;  // of a dot, in diagonals of the shape

}  // namespace

std::vector<float> PointDistances(std::span<const float> a, std::span<const float> b) {
  KPSA_CHECK_EQ(a.size(), b.size());
  std::vector<float> out(a.size() / 3);
  for (std::size_t i = 0; i < out.size(); ++i) {
    const Double3 d = {double{a[3 * i]} - b[3 * i], double{a[3 * i + 1]} - b[3 * i + 1],
                       double{a[3 * i + 2]} - b[3 * i + 2]};
    out[i] = static_cast<float>(Length(d));
  }
  return out;
}

RenderPart MakeDots(const RenderDots& dots, double radius) {
  struct Balls {
    std::vector<float> points;
    std::vector<Index> triangles;
  };
  // An octahedron, every edge halved and blown up: corners 0 .. 5, then the middles of the edges
  constexpr int kCorners[6][3] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  std::vector<Double3> ball;
  for (const auto& c : kCorners)
    ball.push_back({static_cast<double>(c[0]), static_cast<double>(c[1]), static_cast<double>(c[2])});
  std::vector<Index> sides;
  const auto middle = [&](Index a, Index b) {
    const Double3 m = UnitVector(ball[a] + ball[b]);
    for (Index i = 6; i < ball.size(); ++i) {
      if (Length(ball[i] - m) < 1e-9) return i;
    }
    ball.push_back(m);
    return static_cast<Index>(ball.size() - 1);
  };
  for (Index x : {0u, 1u}) {
    for (Index y : {2u, 3u}) {
      for (Index z : {4u, 5u}) {
        const bool outwards = (x + y + z) % 2 == 0;
        const Index a = x, b = outwards ? y : z, c = outwards ? z : y;
        const Index ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
        for (Index corner : {a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca}) sides.push_back(corner);
      }
    }
  }
  auto balls = std::make_shared<Balls>();
  for (std::size_t d = 0; d + 2 < dots.points.size(); d += 3) {
    const auto first = static_cast<Index>(balls->points.size() / 3);
    for (const Double3& p : ball) {
      for (int k = 0; k < 3; ++k)
        balls->points.push_back(dots.points[d + static_cast<std::size_t>(k)] +
                                static_cast<float>(radius * p[k]));
    }
    for (Index corner : sides) balls->triangles.push_back(first + corner);
  }
  RenderPart part;
  part.points = balls->points, part.triangles = balls->triangles;
  part.color = {0.85, 0.03, 0.02};
  part.casts_shadows =
      false;  // light is known at points alone: a ball on a large triangle would darken all of it
  part.owner = balls;
  return part;
}

Result<Image> RenderComparison(const RenderInput& full, const RenderInput& accelerated, const Camera& camera,
                               const RenderOptions& options, const RenderDots* dots,
                               const std::string& title) {
  if (full.parts.size() != accelerated.parts.size()) {
    return Status::Usage("{} parts cannot be compared with {}", full.parts.size(), accelerated.parts.size());
  }
  std::vector<std::vector<float>> distances(full.parts.size());
  RenderInput heat = full;
  float largest = 0;
  for (std::size_t i = 0; i < full.parts.size(); ++i) {
    if (full.parts[i].points.size() != accelerated.parts[i].points.size()) {
      return Status::Usage("part {} has {} coordinates in one pose and {} in the other", i,
                           full.parts[i].points.size(), accelerated.parts[i].points.size());
    }
    distances[i] = PointDistances(full.parts[i].points, accelerated.parts[i].points);
    for (float d : distances[i]) largest = std::max(largest, d);
    heat.parts[i].scalars = distances[i];
  }
  RenderInput dotted;
  std::vector<std::pair<const RenderInput*, std::string>> panels = {
      {&full, "full"}, {&accelerated, title}, {&heat, "error " + Millimetres(largest) + " max"}};
  if (dots != nullptr) {
    dotted = full;
    Double3 center;
    dotted.parts.push_back(MakeDots(*dots, kDotRadius * Diagonal(full, &center)));
    panels.insert(panels.begin() + 1, {&dotted, dots->title});
  }
  std::vector<Image> images;
  for (const auto& [input, caption] : panels) {
    Result<Image> image = RenderMesh(*input, camera, options);
    if (!image.ok()) return image.status();
    images.push_back(std::move(*image));
    DrawTitle(images.back(), caption);
  }
  images.push_back(LegendPanel(options.height, {full.scalar_max, full.tolerance}));
  return SideBySide(images);
}

}  // namespace kpsa::engine
