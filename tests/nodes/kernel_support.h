// What the tests and the benchmark of the kernels share: synthetic meshes, and plain loops to compare with.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <random>
#include <span>
#include <utility>
#include <vector>

#include "base/check.h"
#include "base/matrix.h"
#include "base/points.h"
#include "nodes/kernels/topology.h"

namespace kpsa::engine {

// Fixed seeds give fixed numbers with every standard library: only raw mt19937 output is used.
class Random {
 public:
  explicit Random(std::uint32_t seed) : engine_(seed) {}
  std::uint32_t Below(std::size_t n) { return static_cast<std::uint32_t>(engine_() % n); }
  double Unit() { return engine_() / 4294967296.0; }
  double Signed() { return 2 * Unit() - 1; }
  Double3 Vector() { return {Signed(), Signed(), Signed()}; }
  Quaternion Rotation() { return Normalized({Signed(), Signed(), Signed(), Signed()}); }

 private:
  std::mt19937 engine_;
};

struct TestMesh {
  PointBuffer rest;
  Topology topology;
  std::size_t count() const { return rest.count(); }
};

// A wavy sheet of nu x nv points, about a metre wide; each quad is split along a random diagonal, so that
// points have 4 to 8 neighbours.
inline TestMesh MakeSheet(Index nu, Index nv, std::uint32_t seed = 1) {
  Random random(seed);
  std::vector<float> xyz;
  std::vector<Index> triangles;
  for (Index v = 0; v < nv; ++v) {
    for (Index u = 0; u < nu; ++u) {
      const double x = static_cast<double>(u) / nu - 0.5, y = static_cast<double>(v) / nv - 0.5;
      const double z =
          0.2 * std::cos(3 * x) * std::cos(2 * y) + 0.01 * std::sin(40 * x + 3) * std::sin(31 * y);
      for (double c : {x + 0.1 / nu * random.Signed(), y + 0.1 / nv * random.Signed(), z}) {
        xyz.push_back(static_cast<float>(c));
      }
      if (u + 1 == nu || v + 1 == nv) continue;
      const Index a = u + nu * v, b = a + 1, c = a + nu, d = c + 1;
      if (random.Below(2) == 0) {
        triangles.insert(triangles.end(), {a, b, d, a, d, c});
      } else {
        triangles.insert(triangles.end(), {a, b, c, b, d, c});
      }
    }
  }
  Result<Topology> topology = Topology::Build(nu * nv, triangles);
  KPSA_CHECK(topology.ok());
  return {PointBuffer::FromInterleaved(xyz), *topology};
}

// Skin weights of `influences` joints a point, sometimes fewer; they sum to 1 up to float.
struct TestSkin {
  std::vector<Index> offsets = {0}, joints;
  std::vector<float> weights;
};
inline TestSkin MakeSkin(std::size_t points, Index joint_count, int influences, bool ragged,
                         std::uint32_t seed = 2) {
  Random random(seed);
  TestSkin skin;
  for (std::size_t p = 0; p < points; ++p) {
    const int n =
        ragged ? 1 + static_cast<int>(random.Below(static_cast<std::size_t>(influences))) : influences;
    std::vector<double> w;
    double sum = 0;
    for (int i = 0; i < n; ++i) w.push_back(0.05 + random.Unit()), sum += w.back();
    const Index base = static_cast<Index>(p * joint_count / points);
    for (int i = 0; i < n; ++i) {
      skin.joints.push_back((base + 3 * static_cast<Index>(i) + random.Below(3)) % joint_count);
      skin.weights.push_back(static_cast<float>(w[static_cast<std::size_t>(i)] / sum));
    }
    skin.offsets.push_back(static_cast<Index>(skin.joints.size()));
  }
  return skin;
}

inline std::vector<Matrix4> MakePalette(Index joint_count, Double3 place, std::uint32_t seed = 3) {
  Random random(seed);
  std::vector<Matrix4> palette;
  for (Index j = 0; j < joint_count; ++j) {
    // One after the other: compilers draw arguments of a call in different orders
    const Double3 scale = Double3{1, 1, 1} + random.Vector() * 0.2;
    const Quaternion rotation = random.Rotation();
    palette.push_back(ComposeTrs(place + random.Vector() * 0.2, rotation, scale));
  }
  return palette;
}

// Of joints, as skins read them.
inline std::vector<const Matrix4*> Pointers(const std::vector<Matrix4>& matrices) {
  std::vector<const Matrix4*> pointers;
  for (const Matrix4& matrix : matrices) pointers.push_back(&matrix);
  return pointers;
}

// Offsets of a wire's vertices, in one view.
class WireOffsets {
 public:
  explicit WireOffsets(std::span<const Double3> offsets)
      : buffer_(PointBuffer::FromPlaces(offsets)), view_(std::as_const(buffer_).view()) {}
  operator std::span<const ConstPointsView>() const { return {&view_, 1}; }  // NOLINT: implicit by design

 private:
  PointBuffer buffer_;
  ConstPointsView view_;
};

// The controls of a lattice whose offsets are not 0.
inline std::vector<Index> MovedControls(std::span<const Double3> offsets) {
  std::vector<Index> moved;
  for (Index c = 0; c < offsets.size(); ++c) {
    if (!(offsets[c] == Double3())) moved.push_back(c);
  }
  return moved;
}

struct TestTarget {
  std::vector<Index> points;
  std::vector<float> deltas;
};
// Targets that each move a run of the points, of the given share of the mesh.
inline std::vector<TestTarget> MakeTargets(std::size_t points, std::size_t count, double share,
                                           std::uint32_t seed = 4) {
  Random random(seed);
  std::vector<TestTarget> targets(count);
  for (TestTarget& target : targets) {
    const std::size_t size = static_cast<std::size_t>(share * static_cast<double>(points));
    const std::size_t first = random.Below(points - size + 1);
    for (std::size_t p = first; p < first + size; ++p) {
      if (random.Below(8) == 0) continue;
      target.points.push_back(static_cast<Index>(p));
      for (int c = 0; c < 3; ++c) target.deltas.push_back(static_cast<float>(0.02 * random.Signed()));
    }
  }
  return targets;
}

inline std::vector<Double3> ToDouble(ConstPointsView points) {
  std::vector<Double3> result;
  for (std::size_t i = 0; i < points.count; ++i) result.push_back({points.x[i], points.y[i], points.z[i]});
  return result;
}

inline double MaxDistance(const std::vector<Double3>& a, const std::vector<Double3>& b) {
  double largest = a.size() == b.size() ? 0 : INFINITY;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    const double distance = Length(a[i] - b[i]);
    if (!(distance <= largest)) largest = distance;
  }
  return largest;
}

}  // namespace kpsa::engine
