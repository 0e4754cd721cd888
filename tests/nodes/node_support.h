// For tests of nodes: the standard nodes, points as values, random frames, distances of matrices.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "base/matrix.h"
#include "base/scalar_math.h"
#include "nodes/standard_nodes.h"
#include "tests/support/test_graph.h"

namespace kpsa::engine {

inline const NodeRegistry& StandardNodes() {
  static const NodeRegistry* registry = [] {
    auto* nodes = new NodeRegistry;
    AddStandardNodes(*nodes);
    return nodes;
  }();
  return *registry;
}

inline Value PointsOf(const std::vector<float>& xyz) {
  return Value(PointBufferPtr(std::make_shared<PointBuffer>(PointBuffer::FromInterleaved(xyz))));
}

inline void ExpectPoints(const std::vector<float>& got, const std::vector<double>& expected,
                         double tolerance = 1e-6) {
  ASSERT_EQ(got.size(), expected.size());
  for (std::size_t i = 0; i < got.size(); ++i) EXPECT_NEAR(got[i], expected[i], tolerance) << i;
}

class RandomFrames {
 public:
  explicit RandomFrames(unsigned seed) : random_(seed) {}
  double Number(double lo, double hi) { return std::uniform_real_distribution<double>(lo, hi)(random_); }
  Double3 Vector(double size = 1) { return {Number(-size, size), Number(-size, size), Number(-size, size)}; }
  Quaternion Turn() {
    return Normalized({Number(-1, 1), Number(-1, 1), Number(-1, 1), Number(-1, 1) + 1e-3});
  }
  Matrix4 Rigid(double size = 1) { return ComposeTrs(Vector(size), Turn(), {1, 1, 1}); }
  Matrix4 Scaled() { return ComposeTrs(Vector(), Turn(), {Number(0.5, 2), Number(0.5, 2), Number(0.5, 2)}); }

 private:
  std::mt19937 random_;
};

inline double Apart(const Matrix4& a, const Matrix4& b) {
  double worst = 0;
  for (std::size_t i = 0; i < a.m.size(); ++i) {
    const double d = std::fabs(a.m[i] - b.m[i]);
    worst = d <= worst ? worst : d;
    if (!(d < 1e30)) return 1e30;
  }
  return worst;
}
inline double Apart(Double3 a, Double3 b) { return Length(a - b); }
inline Double3 PlaceIn(const Matrix4& m) { return {m(0, 3), m(1, 3), m(2, 3)}; }
inline Double3 AxisOf(const Matrix4& m, int column) { return {m(0, column), m(1, column), m(2, column)}; }

// A node whose inputs vary: rest values are what it is made with, Now sets others.
class PosedNode {
 public:
  PosedNode(const std::string& type, const std::vector<std::pair<std::string, Value>>& rest,
            const std::vector<std::string>& varying)
      : g(StandardNodes()) {
    g.add(type, "n", rest);
    for (const std::string& attribute : varying) g.vary("n." + attribute);
    for (const AttributeDef& a : StandardNodes().Find(type)->attributes) {  // before anything is set
      if (a.output && !a.array) g.want("n." + a.name);
    }
  }
  template <typename T>
  void Now(const std::string& attribute, const T& value) {
    g.set("n." + attribute, value);
  }
  template <typename T = Matrix4>
  T Out(const std::string& attribute = "outMatrix") {
    return g.pull<T>("n." + attribute);
  }
  std::string Error(const std::string& attribute = "outMatrix") {
    const Status status = g.try_pull("n." + attribute);
    return status.ok() ? "no error" : status.ToString();
  }
  TestGraph g;
};

}  // namespace kpsa::engine
