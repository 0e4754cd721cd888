// What holds of every generated mesh. Failures are reported to GoogleTest with `name`.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "scenes/glb_writer.h"

namespace kpsa::engine::scenes {

// Every edge has two quads that run along it in opposite directions, or it lies on a border; returns the
// number of borders.
inline int CountBorders(const std::vector<std::array<int, 4>>& quads, const std::string& name) {
  std::map<std::pair<int, int>, int> directed;
  for (const auto& q : quads) {
    for (std::size_t k = 0; k < 4; ++k) {
      if (q[k] != q[(k + 1) % 4]) ++directed[{q[k], q[(k + 1) % 4]}];
    }
  }
  std::map<int, int> border;
  for (const auto& [edge, count] : directed) {
    EXPECT_EQ(count, 1) << name << " " << edge.first << "-" << edge.second;
    if (!directed.contains({edge.second, edge.first})) border[edge.first] = edge.second;
  }
  int loops = 0;
  for (; !border.empty(); ++loops) {
    for (auto at = border.begin(); at != border.end();) {
      const int next = at->second;
      border.erase(at);
      at = border.find(next);
    }
  }
  return loops;
}

// No two points coincide, and no triangle is of less than half of `least`.
inline void CheckPointsAndTriangles(const std::vector<Double3>& points,
                                    const std::vector<std::array<int, 4>>& quads, double least,
                                    const std::string& name) {
  std::set<std::array<double, 3>> places;
  for (const Double3& p : points) places.insert({p.x, p.y, p.z});
  EXPECT_EQ(places.size(), points.size()) << name;
  const std::vector<Index> triangles = Triangulate(quads);
  for (std::size_t t = 0; t < triangles.size(); t += 3) {
    const Double3 a = points[triangles[t]], b = points[triangles[t + 1]], c = points[triangles[t + 2]];
    EXPECT_GT(Length(Cross(b - a, c - a)), least) << name << " triangle " << t / 3;
  }
}

}  // namespace kpsa::engine::scenes
