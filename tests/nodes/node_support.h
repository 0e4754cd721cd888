// What tests of single nodes share: the standard registry, points as values, and their comparison.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "nodes/standard_nodes.h"
#include "tests/support/test_graph.h"

namespace kpsa {

inline const NodeRegistry& Nodes() {
  static const NodeRegistry* registry = [] {
    auto* r = new NodeRegistry;
    AddStandardNodes(*r);
    return r;
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

}  // namespace kpsa
