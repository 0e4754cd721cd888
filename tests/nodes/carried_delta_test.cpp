// Carried and waiting deltas are the products that they stand for, with the same bits on every vector unit.
#include "nodes/kernels/carried_delta.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "base/simd.h"
#include "tests/nodes/kernel_support.h"

namespace kpsa::engine {
namespace {

// Affine ones, such that have no inverse, and such that are not finite.
std::vector<Matrix4> Matrices() {
  Random random(71);
  std::vector<Matrix4> all = {Matrix4(), Scaling({1, 0, 1}), Scaling({1e-200, 1e-200, 1e-200})};
  for (int i = 0; i < 400; ++i) {
    Matrix4 m = ComposeTrs(random.Vector(), random.Rotation(), Double3{1, 1, 1} + random.Vector() * 0.5);
    for (int k = 0; k < 3 && i % 3 == 1; ++k) m(static_cast<int>(random.Below(3)), k) = random.Signed();
    if (i % 20 == 1) m(0, 0) = m(1, 0) = m(2, 0) = 0;
    if (i % 50 == 7) m.m[4 * random.Below(4)] = std::numeric_limits<double>::quiet_NaN();
    if (i % 50 == 8) m.m[4 * random.Below(4)] = std::numeric_limits<double>::infinity();
    all.push_back(m);
  }
  return all;
}

bool IsFinite(const AffineDelta& delta) {
  float sum = 0;
  for (float number : delta.linear) sum += number * 0;
  for (int i = 0; i < 4; ++i) sum += (delta.pivot[i] + delta.offset[i]) * 0;
  return sum == 0;
}
// What is not a number is as any other.
std::vector<std::uint32_t> Bits(const AffineDelta& delta) {
  std::vector<std::uint32_t> bits = {delta.is_zero};
  const auto add = [&](float number) {
    bits.push_back(std::isnan(number) ? 0x7fc00000u : std::bit_cast<std::uint32_t>(number));
  };
  for (std::size_t i = 0; i < 12; ++i) {
    if (i % 4 != 3) add(delta.linear[i]);
  }
  for (std::size_t i = 0; i < 3; ++i) add(delta.pivot[i]), add(delta.offset[i]);
  return bits;
}
// The largest difference, in sizes of the matrix.
double Apart(const AffineDelta& a, const Matrix4& matrix, Double3 pivot) {
  const AffineDelta b = MakeAffineDelta(matrix, pivot);
  double most = 0, size = 1;
  for (const double entry : matrix.m) size = std::max(size, std::fabs(entry));
  for (std::size_t i = 0; i < 12; ++i) most = std::max<double>(most, std::fabs(a.linear[i] - b.linear[i]));
  for (std::size_t i = 0; i < 3; ++i) {
    most = std::max<double>(most, std::fabs(a.pivot[i] - b.pivot[i]));
    most = std::max<double>(most, std::fabs(a.offset[i] - b.offset[i]));
  }
  return most / size;
}

class CarriedDelta : public ::testing::Test {
 protected:
  ~CarriedDelta() override { SelectSimdTarget(""); }
  void Expect(const AffineDelta& delta, const Matrix4& matrix, Double3 pivot) {
    if (bits_.size() <= at_) bits_.push_back(Bits(delta));
    EXPECT_EQ(bits_[at_], Bits(delta));
    ++at_;
    finite_ += IsFinite(MakeAffineDelta(matrix, pivot));
    if (IsFinite(MakeAffineDelta(matrix, pivot))) {
      EXPECT_LT(Apart(delta, matrix, pivot), 1e-6);
    }
  }
  const std::vector<Matrix4> matrices_ = Matrices();
  std::vector<std::vector<std::uint32_t>> bits_;  // of the first target
  std::size_t at_ = 0, finite_ = 0;
};

TEST_F(CarriedDelta, IsTheProductOfItsMatricesOnEveryTarget) {
  for (const std::string target : {"avx512", "avx2", "neon", "scalar"}) {
    if (!SelectSimdTarget(target)) continue;
    Random random(72);
    const auto any = [&]() -> const Matrix4& { return matrices_[random.Below(matrices_.size())]; };
    at_ = 0, finite_ = 0;
    std::size_t singular = 0;
    for (const Matrix4& parent : matrices_) {
      const Matrix4 &handle = any(), &after = any(), &before = any();
      const Double3 pivot = random.Vector();
      Matrix4 inverse;
      singular += !Invert(parent, &inverse);
      inverse = InverseOrIdentity(parent);
      AffineDelta delta;
      FindCarriedDelta(handle, parent, {after, pivot}, &delta);
      Expect(delta, handle * after * inverse, TransformPoint(parent, pivot));
      FindWaitingDelta(handle, parent, {before, after, pivot}, &delta);
      Expect(delta, before * inverse * handle * after, pivot);
    }
    EXPECT_GT(singular, 20u);
    EXPECT_GT(finite_, 500u);
  }
}

TEST_F(CarriedDelta, OfWhatRestsIsExactlyNone) {
  AffineDelta delta;
  FindCarriedDelta(Translation({1, 2, 3}), Translation({4, 5, 6}), {Translation({3, 3, 3}), {1, 1, 1}},
                   &delta);
  EXPECT_TRUE(delta.is_zero);
  FindCarriedDelta(Translation({1, 2, 3.5}), Translation({4, 5, 6}), {Translation({3, 3, 3}), {1, 1, 1}},
                   &delta);
  EXPECT_FALSE(delta.is_zero);
  EXPECT_EQ(delta.offset[2], 0.5f);
}

}  // namespace
}  // namespace kpsa::engine
