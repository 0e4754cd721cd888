// FindCarriedDelta gives the bits of the products that it stands for, on every vector unit.
#include "nodes/kernels/carried_delta.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "base/simd.h"
#include "tests/nodes/kernel_support.h"

namespace kpsa::engine {
namespace {

// Of bits, but that one NaN is as good as another.
bool SameNumbers(const Matrix4& a, const Matrix4& b) {
  for (std::size_t i = 0; i < 16; ++i) {
    if (std::isnan(a.m[i]) ? !std::isnan(b.m[i]) : std::memcmp(&a.m[i], &b.m[i], sizeof(double)) != 0)
      return false;
  }
  return true;
}

// Affine ones, any, and such with zeros of both signs, that have no inverse, that are not finite.
std::vector<Matrix4> Matrices() {
  Random random(71);
  std::vector<Matrix4> all = {Matrix4(), Scaling({1, 0, 1}), Scaling({1e-200, 1e-200, 1e-200})};
  for (int i = 0; i < 400; ++i) {
    Matrix4 m = ComposeTrs(random.Vector(), random.Rotation(), Double3{1, 1, 1} + random.Vector() * 0.5);
    if (i % 3 == 1) {
      for (double& entry : m.m) entry = random.Signed();
    }
    if (i % 4 == 1) {
      for (int k = 0; k < 5; ++k) m.m[random.Below(16)] = k % 2 == 0 ? 0.0 : -0.0;
    }
    if (i % 50 == 7) m.m[random.Below(16)] = std::numeric_limits<double>::quiet_NaN();
    if (i % 50 == 8) m.m[random.Below(16)] = std::numeric_limits<double>::infinity();
    all.push_back(m);
  }
  return all;
}

TEST(CarriedDelta, HasTheBitsOfItsProducts) {
  const std::vector<Matrix4> matrices = Matrices();
  Random random(72);
  const auto any = [&]() -> const Matrix4& { return matrices[random.Below(matrices.size())]; };
  for (const std::string target : {"avx512", "avx2", "scalar"}) {
    if (!SelectSimdTarget(target)) continue;
    std::size_t singular = 0, differ = 0;
    for (const Matrix4& parent : matrices) {
      const Matrix4 &handle = any(), &rest = any(), &parent_rest_inverse = any();
      CarriedDelta carried;
      FindCarriedDelta(handle, rest, parent, parent_rest_inverse, &carried);
      Matrix4 inverse;
      singular += !Invert(parent, &inverse);
      differ += !SameNumbers(carried.delta, handle * rest * InverseOrIdentity(parent));
      differ += !SameNumbers(carried.motion, parent * parent_rest_inverse);
    }
    EXPECT_EQ(differ, 0u) << target;
    EXPECT_GT(singular, 10u);
  }
  SelectSimdTarget("");
  EXPECT_FALSE(SameNumbers(Scaling({1, 1, 1}), Scaling({1, -0.0, 1})));  // it does tell numbers apart
}

}  // namespace
}  // namespace kpsa::engine
