// The frames of driver points against their definition, in double.
#include "nodes/kernels/driver_frames.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/simd.h"
#include "nodes/kernels/weights.h"
#include "tests/nodes/kernel_support.h"

namespace kpsa::engine {
namespace {

std::vector<Double3> NormalsOf(const Topology& topology, std::span<const Double3> points) {
  std::vector<Double3> normals(points.size());
  const auto triangles = topology.triangles();
  for (std::size_t t = 0; t < triangles.size(); t += 3) {
    const Double3 cross = Cross(points[triangles[t + 1]] - points[triangles[t]],
                                points[triangles[t + 2]] - points[triangles[t]]);
    for (std::size_t k = 0; k < 3; ++k) normals[triangles[t + k]] = normals[triangles[t + k]] + cross;
  }
  for (Double3& n : normals) n = Length(n) == 0 ? n : n * (1 / Length(n));
  return normals;
}

// (sum e' e^T + s n' n^T) M^-1; false where M has none.
bool Frame(const Topology& topology, std::span<const Double3> rest, std::span<const Double3> now, Index point,
           Double3 rest_normal, Double3 normal, Matrix4* frame) {
  Matrix4 moved, m;
  for (int r = 0; r < 3; ++r) moved(r, r) = m(r, r) = 0;
  const auto add = [](Double3 a, Double3 b, double weight, Matrix4* to) {
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) (*to)(r, c) += weight * a[r] * b[c];
    }
  };
  double square = 0;
  const auto ring = topology.neighbors().row(point);
  for (const Index j : ring) {
    const Double3 edge = rest[j] - rest[point];
    add(now[j] - now[point], edge, 1, &moved);
    add(edge, edge, 1, &m);
    square += Dot(edge, edge);
  }
  add(normal, rest_normal, square / static_cast<double>(ring.size()), &moved);
  add(rest_normal, rest_normal, square / static_cast<double>(ring.size()), &m);
  Matrix4 inverse;
  if (ring.empty() || !(Determinant3(m) > 1e-10 * square * square * square) || !Invert(m, &inverse))
    return false;
  *frame = moved * inverse;
  return true;
}

// Holds every frame of a mesh that bends against the definition.
void ExpectFrames(const Topology& topology, std::span<const Double3> rest, std::size_t least) {
  std::vector<Double3> now(rest.begin(), rest.end());
  for (Double3& p : now) p = {p.x * 1.1 + 0.3 * p.y * p.y, p.y - 0.2 * p.x * p.z, p.z + 0.4 * p.x * p.y};
  const std::vector<Double3> rest_normals = NormalsOf(topology, rest), normals = NormalsOf(topology, now);
  const std::vector<Index> all = AllPoints(rest.size());
  const DriverFrames frames(topology, rest, all, all);
  AlignedFloats points(4 * PaddedCount(rest.size())), floats(frames.Floats());
  for (std::size_t i = 0; i < rest.size(); ++i) {
    for (int k = 0; k < 3; ++k)
      points.data()[4 * i + static_cast<std::size_t>(k)] = static_cast<float>(now[i][k]);
  }
  frames.Run(points.data(), floats.data());
  std::size_t found = 0;
  for (const Index i : all) {
    const float* f = floats.data() + frames.begin(i);
    for (int k = 0; k < 3; ++k) EXPECT_EQ(f[4 * k + 3], points.data()[4 * i + static_cast<std::size_t>(k)]);
    Matrix4 expected;
    const bool exists = Frame(topology, rest, now, i, rest_normals[i], normals[i], &expected);
    ASSERT_EQ(frames.exists(i), exists) << i;
    if (!exists) continue;
    ++found;
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(f[4 * c + r], expected(r, c), 2e-5) << "point " << i;
      EXPECT_NEAR(f[12 + r], normals[i][r], 2e-5) << "point " << i;
    }
  }
  EXPECT_GE(found, least);
}

TEST(DriverFrames, AreTheirDefinition) {
  const TestMesh sheet = MakeSheet(37, 29);
  ExpectFrames(sheet.topology, ToDouble(sheet.rest.view()), sheet.count());
}

// Rings that are no single fan: point 0 in two fans and in two closed ones, an edge with three faces, faces that
// disagree about what is outside, one face twice, points of one face and of none.
TEST(DriverFrames, OfRingsInPieces) {
  Random random(3);
  std::vector<Double3> rest;
  for (int i = 0; i < 12; ++i) rest.push_back(random.Vector());
  const std::vector<std::vector<Index>> meshes = {
      {0, 1, 2, 0, 2, 3, 0, 4, 5, 0, 5, 6, 7, 8, 9}, {0, 1, 2, 0, 2, 3, 0, 3, 1, 0, 4, 5, 0, 5, 6, 0, 6, 4},
      {0, 1, 2, 1, 0, 3, 0, 1, 4, 1, 4, 5},          {0, 1, 2, 0, 3, 2, 0, 3, 4, 4, 1, 0},
      {0, 1, 2, 0, 1, 2, 0, 2, 3, 3, 2, 1},          {0, 1, 2, 0, 2, 3, 0, 3, 1, 0, 1, 4, 0, 4, 5}};
  for (const std::vector<Index>& triangles : meshes) {
    const Result<Topology> topology = Topology::Build(static_cast<Index>(rest.size()), triangles);
    ASSERT_TRUE(topology.ok());
    ExpectFrames(*topology, rest, 4);
  }
}

}  // namespace
}  // namespace kpsa::engine
