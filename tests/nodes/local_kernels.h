// What the tests of local kernels run on: a sheet with a weight for each point.
#pragma once

#include <gtest/gtest.h>

#include <cstring>
#include <vector>

#include "nodes/kernels/weights.h"
#include "tests/nodes/kernel_support.h"

namespace kpsa::engine {

inline bool SameBits(ConstPointsView a, ConstPointsView b, std::size_t i) {
  return std::memcmp(a.x + i, b.x + i, 4) == 0 && std::memcmp(a.y + i, b.y + i, 4) == 0 &&
         std::memcmp(a.z + i, b.z + i, 4) == 0;
}

// Runs a kernel on all points of a mesh, out of place.
template <typename Kernel>
PointBuffer Evaluate(const Kernel& kernel, const typename Kernel::Inputs& inputs, ConstPointsView in) {
  PointBuffer out(kernel.point_count());
  AlignedFloats scratch(kernel.ScratchFloats());
  kernel.Run(inputs, in, out.view(), scratch.span());
  return out;
}

class LocalKernels : public testing::Test {
 protected:
  LocalKernels()
      : mesh_(MakeSheet(37, 31)), all_(AllPoints(mesh_.count())), rest_(ToDouble(mesh_.rest.view())) {
    Random random(31);
    for (std::size_t i = 0; i < mesh_.count(); ++i)
      mask_.push_back(i % 4 == 0 ? 0.0f : static_cast<float>(random.Unit()));
  }
  ConstPointsView in() const { return mesh_.rest.view(); }

  TestMesh mesh_;
  std::vector<Index> all_;
  std::vector<Double3> rest_;
  std::vector<float> mask_;
};

}  // namespace kpsa::engine
