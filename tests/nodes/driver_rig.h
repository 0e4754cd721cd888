// A graph with a mesh that drives (moved by a matrix) and a mesh that follows it with one deformer.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "graph/geometry.h"
#include "nodes/standard_nodes.h"
#include "tests/nodes/kernel_support.h"
#include "tests/support/test_graph.h"

namespace kpsa::engine {

inline const NodeRegistry& NodesUnderTest() {
  static const NodeRegistry* registry = [] {
    auto* nodes = new NodeRegistry;
    AddStandardNodes(*nodes);
    return nodes;
  }();
  return *registry;
}

inline std::shared_ptr<const Mesh> MeshOf(std::vector<float> xyz, std::vector<Index> triangles) {
  Mesh::Data data;
  data.name = "mesh";
  data.rest = PointBuffer::FromInterleaved(xyz);
  data.triangles = std::move(triangles);
  for (Index i = 0; i < data.rest.count(); ++i) data.vertex_to_point.push_back(i);
  return std::make_shared<const Mesh>(std::move(data));
}

// nu x nv points over [-1, 1] x [-1, 1], raised by height(x, y).
template <typename F>
std::shared_ptr<const Mesh> GridMesh(Index nu, Index nv, F height) {
  std::vector<float> xyz;
  std::vector<Index> triangles;
  for (Index v = 0; v < nv; ++v) {
    for (Index u = 0; u < nu; ++u) {
      const double x = 2.0 * u / (nu - 1) - 1, y = 2.0 * v / (nv - 1) - 1;
      for (double c : {x, y, static_cast<double>(height(x, y))}) xyz.push_back(static_cast<float>(c));
      if (u + 1 == nu || v + 1 == nv) continue;
      const Index a = u + nu * v, b = a + 1, c = a + nu, d = c + 1;
      triangles.insert(triangles.end(), {a, b, d, a, d, c});
    }
  }
  return MeshOf(std::move(xyz), std::move(triangles));
}

struct DriverRig {
  TestGraph g{NodesUnderTest()};
  std::shared_ptr<const Mesh> driver, follower;

  DriverRig(const std::string& type, std::shared_ptr<const Mesh> driver_mesh,
            std::shared_ptr<const Mesh> follower_mesh,
            const std::vector<std::pair<std::string, Value>>& values = {})
      : driver(std::move(driver_mesh)), follower(std::move(follower_mesh)) {
    g.add("mesh", "cage", {{"mesh", driver}});
    g.add("transformGeometry", "move");
    g.add("mesh", "cloth", {{"mesh", follower}});
    g.add(type, "w", values);
    g.hold("w.mesh[0]", follower);
    g.hold("w.driverMesh", driver);
    g.connect("cage.points", "move.inPoints[0]");
    g.connect("move.outPoints[0]", "w.driverPoints");
    g.connect("cloth.points", "w.inPoints[0]");
    g.vary("move.matrix");
    g.want("w.outPoints[0]");
  }
  std::vector<Double3> Rest() const { return ToDouble(std::as_const(follower->data()).rest.view()); }
  std::vector<Double3> Points() {
    const std::vector<float> xyz = g.pull_points("w.outPoints[0]");
    std::vector<Double3> points;
    for (std::size_t i = 0; i + 2 < xyz.size(); i += 3) points.push_back({xyz[i], xyz[i + 1], xyz[i + 2]});
    return points;
  }
  std::vector<Double3> At(const Matrix4& motion) {
    g.set("move.matrix", motion);
    return Points();
  }
  // Points of a step in the plan.
  Index PointsOf(const std::string& node) const {
    Index most = 0;
    for (Index s = 0; s < g.plan->steps().size(); ++s) {
      if (node == g.plan->step_name(s)) most = std::max(most, g.plan->infos()[s].points);
    }
    return most;
  }
  // A subset has the bits that the whole has, at a few motions; the number of driver points that it needed.
  Index ExpectSubsetsKeepTheBits(std::size_t size) {
    Random random(5);
    std::vector<Index> some;
    for (std::size_t i = 0; i < size; ++i) some.push_back(random.Below(follower->point_count()));
    const PointSet set = PointSet::Of(some, follower->point_count());
    std::vector<Matrix4> motions;
    for (int i = 0; i < 3; ++i)
      motions.push_back(ComposeTrs(random.Vector() * 0.1, random.Rotation(), {1, 1.2, 0.9}));
    std::vector<std::vector<Double3>> whole;
    for (const Matrix4& motion : motions) whole.push_back(At(motion));
    g.request.outputs.clear();
    g.names.clear();
    g.plan = nullptr;
    g.want("w.outPoints[0]", set);
    for (std::size_t m = 0; m < motions.size(); ++m) {
      const std::vector<Double3> part = At(motions[m]);
      EXPECT_EQ(part.size(), set.size());
      for (Index i = 0; i < set.size(); ++i) EXPECT_EQ(part[i], whole[m][set[i]]) << i;
    }
    return PointsOf("move");
  }
};

}  // namespace kpsa::engine
