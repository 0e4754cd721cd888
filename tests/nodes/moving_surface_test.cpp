#include "nodes/kernels/moving_surface.h"

#include <gtest/gtest.h>

#include <optional>
#include <vector>

#include "base/parallel.h"

namespace kpsa::engine {
namespace {

// A strip of squares in the plane of height z.
PointBuffer Strip(float z) {
  std::vector<float> xyz;
  for (int i = 0; i < 20; ++i) {
    for (const float y : {0.0f, 1.0f}) xyz.insert(xyz.end(), {static_cast<float>(i), y, z});
  }
  return PointBuffer::FromInterleaved(xyz);
}

std::vector<Index> StripTriangles() {
  std::vector<Index> triangles;
  for (Index i = 0; i < 38; ++i) triangles.insert(triangles.end(), {i, i + 1, i + 2});
  return triangles;
}

TEST(MovingSurface, EvaluationsHaveTreesOfTheirOwn) {
  const PointBuffer rest = Strip(0), up = Strip(3), down = Strip(-2);
  const MovingSurface surface(rest.view(), StripTriangles());
  EXPECT_EQ(surface.point_count(), 40u);
  std::optional<MovingSurface::Lease> first = surface.At(up.view());
  const TriangleTree* const tree = &**first;
  const TriangleTree* other = nullptr;
  {
    const MovingSurface::Lease second = surface.At(down.view());
    other = &*second;
    EXPECT_NE(other, tree);
    EXPECT_EQ((*first)->Closest({4.2, 0.5, 0}).squared, 9);
    EXPECT_EQ(second->Closest({4.2, 0.5, 0}).squared, 4);
  }
  first.reset();
  // The same two again, moved to where they have to be; a third one only while both are in use
  const MovingSurface::Lease third = surface.At(rest.view()), fourth = surface.At(down.view()),
                             fifth = surface.At(up.view());
  EXPECT_EQ(&*third, other);
  EXPECT_EQ(&*fourth, tree);
  EXPECT_TRUE(&*fifth != tree && &*fifth != other);
  EXPECT_EQ(third->Closest({4.2, 0.5, 0}).squared, 0);
  EXPECT_EQ(fourth->Closest({4.2, 0.5, 0}).squared, 4);
  EXPECT_EQ(fifth->Closest({4.2, 0.5, 0}).squared, 9);
}

TEST(MovingSurface, ManyAtOnceAreWhereTheyShouldBe) {
  const PointBuffer rest = Strip(0);
  const MovingSurface surface(rest.view(), StripTriangles());
  std::vector<double> squared(400);
  ParallelFor(squared.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const PointBuffer now = Strip(static_cast<float>(i % 50));
      squared[i] = surface.At(now.view())->Closest({7.5, 0.25, 0}).squared;
    }
  });
  for (std::size_t i = 0; i < squared.size(); ++i)
    EXPECT_EQ(squared[i], static_cast<double>((i % 50) * (i % 50)));
}

}  // namespace
}  // namespace kpsa::engine
