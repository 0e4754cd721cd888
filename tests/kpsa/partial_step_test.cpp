// A last step of some points, against a naive one: each point read for itself.
#include "kpsa/partial_step.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>

#include "kpsa/tiles.h"

namespace kpsa::engine {
namespace {

constexpr Index kRingPoints = 300,
                kRingExtra = 3;  // two tiles and a part of one; inner points behind the points

// What the step of a point reads: neighbours in a ring, and of every 100th point one of those behind them.
std::vector<Index> ReadFor(Index point) {
  std::vector<Index> read = {(point + kRingPoints - 1) % kRingPoints, point, (point + 7) % kRingPoints};
  if (point % 100 == 0) read.push_back(kRingPoints + point / 100);
  return read;
}

class RingStep final : public LastStep {
 public:
  class Part final : public Bound {
   public:
    explicit Part(const PointSet& out) : out_(out.ToVector()) {
      for (const Index point : out_) {
        for (const Index i : ReadFor(point)) inner_.push_back(i);
      }
      std::ranges::sort(inner_);
      inner_.erase(std::unique(inner_.begin(), inner_.end()), inner_.end());
    }
    const std::vector<Index>& inner() const override { return inner_; }
    std::size_t scratch_floats() const override { return 16; }
    void Run(ConstPointsView inner, PointsView out, std::span<float> scratch) const noexcept override {
      std::ranges::fill(scratch.first(scratch_floats()), -1.0f);
      for (std::size_t k = 0; k < out_.size(); ++k) {
        float x = 0, y = 0, z = 0;
        for (const Index i : ReadFor(out_[k]))
          x += inner.x[i], y += 2 * inner.y[i], z += inner.z[i] * inner.x[i];
        out.x[k] = x, out.y[k] = y, out.z[k] = z;
      }
    }

   private:
    std::vector<Index> out_, inner_;
  };
  std::size_t points() const override { return kRingPoints; }
  std::size_t inner_points() const override { return kRingPoints + kRingExtra; }
  Index PointOf(Index inner) const override {
    return inner < kRingPoints ? inner : 100 * (inner - kRingPoints);
  }
  float cost_ns() const override { return 3000; }
  void Inner(ConstPointsView in, PointsView inner) const override {
    for (Index i = 0; i < inner_points(); ++i) {
      const Index from = PointOf(i);
      inner.x[i] = in.x[from] + 1, inner.y[i] = in.y[from] * 3,
      inner.z[i] = in.z[from] - static_cast<float>(i);
    }
  }
  std::unique_ptr<const Bound> Bind(const PointSet& out) const override {
    return std::make_unique<Part>(out);
  }
};

PointBuffer RandomRing(std::size_t count) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> place(-1, 1);
  std::vector<float> xyz(3 * count);
  for (float& v : xyz) v = place(random);
  return PointBuffer::FromInterleaved(xyz);
}

std::vector<float> RunFor(const LastStep& step, const PointSet& out, ConstPointsView inner) {
  const auto bound = step.Bind(out);
  PointBuffer made(out.size());
  AlignedFloats scratch(bound->scratch_floats());
  // Only what it says that it reads
  PointBuffer read(step.inner_points());
  std::ranges::fill(std::span(read.view().x, read.count()), 1e30f);
  for (const Index i : bound->inner())
    read.view().x[i] = inner.x[i], read.view().y[i] = inner.y[i], read.view().z[i] = inner.z[i];
  bound->Run(std::as_const(read).view(), made.view(), scratch.span());
  return made.Interleaved();
}

class PartialStep : public ::testing::TestWithParam<SteppedPoints> {
 protected:
  PartialStep() {
    const PointBuffer in = RandomRing(kRingPoints);
    ring->Inner(in.view(), inner.view());
    partial->Inner(in.view(), some.view());
  }
  const std::shared_ptr<const LastStep> ring = std::make_shared<RingStep>(),
                                        partial = MakePartialStep(ring, GetParam());
  PointBuffer inner{ring->inner_points()}, some{partial->inner_points()};
};

class PartialStepOfTiles : public PartialStep {};

TEST_P(PartialStep, GivesWhatTheStepGives) {
  std::vector<Index> all(kRingPoints);
  std::iota(all.begin(), all.end(), 0u);
  for (const std::vector<Index>& points : {all, {0}, {127, 128}, {5, 100, 200, 255, 256, 299}}) {
    const PointSet out = PointSet::Of(points, kRingPoints);
    EXPECT_EQ(RunFor(*partial, out, std::as_const(some).view()),
              RunFor(*ring, out, std::as_const(inner).view()));
  }
}

// As files of version 12 have them.
TEST_P(PartialStepOfTiles, HasPointsThenInnerPointsOfThese) {
  if (!GetParam().starts.empty())
    GTEST_SKIP() << "of files of version 12; else tests/kpsa/stepped_points_test.cpp";
  PointBuffer out(kRingPoints);
  ring->Bind(PointSet::All(kRingPoints))
      ->Run(std::as_const(inner).view(), out.view(), AlignedFloats(16).span());
  std::vector<Index> behind;
  for (Index point = 0; point < kRingPoints; ++point) {
    const bool stepped = GetParam().Has(point);
    EXPECT_EQ(some.view().x[point], stepped ? inner.view().x[point] : out.view().x[point]) << point;
    for (const Index i : stepped ? ReadFor(point) : std::vector<Index>()) {
      if (i >= kRingPoints || !GetParam().Has(i)) behind.push_back(i);
    }
  }
  std::ranges::sort(behind);
  behind.erase(std::unique(behind.begin(), behind.end()), behind.end());
  ASSERT_EQ(partial->inner_points(), kRingPoints + behind.size());
  for (Index k = 0; k < behind.size(); ++k) {
    EXPECT_EQ(some.view().z[kRingPoints + k], inner.view().z[behind[k]]);
    EXPECT_EQ(partial->PointOf(kRingPoints + k), ring->PointOf(behind[k]));
  }
  EXPECT_LT(partial->cost_ns(), 2 * ring->cost_ns());
}

SteppedPoints RingTiles(const std::vector<Index>& tiles) { return {PointsOfTiles(tiles, kRingPoints), {}}; }
const auto kTileLayouts =
    ::testing::Values(RingTiles({0}), RingTiles({1}), RingTiles({0, 2}), RingTiles({0, 1, 2}));
std::string LayoutName(const ::testing::TestParamInfo<SteppedPoints>& of) {
  return "Layout" + std::to_string(of.index);
}
INSTANTIATE_TEST_SUITE_P(OfTiles, PartialStep, kTileLayouts, LayoutName);
INSTANTIATE_TEST_SUITE_P(OfTiles, PartialStepOfTiles, kTileLayouts, LayoutName);
INSTANTIATE_TEST_SUITE_P(OfPoints, PartialStep,
                         ::testing::Values(LayOut(RingStep(), {0}), LayOut(RingStep(), {299}),
                                           LayOut(RingStep(), {5, 6, 20, 100, 150, 200}),
                                           LayOut(RingStep(), PointSet::All(kRingPoints).ToVector())),
                         LayoutName);

TEST(PointsOfTiles, EndWithTheMesh) {
  EXPECT_EQ(PointsOfTiles(std::vector<Index>{2}, 258), (std::vector<Index>{256, 257}));
  EXPECT_TRUE(PointsOfTiles(std::vector<Index>{3}, 258).empty());
}

}  // namespace
}  // namespace kpsa::engine
