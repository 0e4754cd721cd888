// Positions as a report stores them, against the positions themselves.
#include "report/page_shape.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <random>

namespace kpsa::engine {
namespace {

using Rows = std::vector<std::vector<float>>;

std::vector<std::span<const float>> Spans(const Rows& rows) { return {rows.begin(), rows.end()}; }

std::vector<float> RandomPoints(std::size_t count, double size, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0, size);
  std::vector<float> values(3 * count);
  for (float& value : values) value = static_cast<float>(normal(random));
  return values;
}

// The rest shape plus some motions that wave, each smaller than the one before.
Rows Waves(const std::vector<float>& rest, std::size_t rows, std::size_t motions) {
  Rows poses;
  for (std::size_t r = 0; r < rows; ++r) {
    poses.push_back(rest);
    for (std::size_t m = 0; m < motions; ++m) {
      const std::vector<float> motion = RandomPoints(rest.size() / 3, 1, 100 + m);
      const double factor = 0.1 * std::pow(0.3, static_cast<double>(m)) *
                            std::sin(0.37 * static_cast<double>(r) * static_cast<double>(m + 1));
      for (std::size_t i = 0; i < rest.size(); ++i)
        poses[r][i] += static_cast<float>(factor * static_cast<double>(motion[i]));
    }
  }
  return poses;
}

// By the formula of docs/viewer-data.md, in float64.
double LargestDistance(const PageShape& shape, const std::vector<float>& rest, const Rows& rows) {
  double largest = 0;
  for (std::size_t r = 0; r < rows.size(); ++r) {
    for (std::size_t v = 0; v < rest.size() / 3; ++v) {
      double square = 0;
      for (std::size_t i = 3 * v; i < 3 * v + 3; ++i) {
        double x = rest[i];
        for (std::size_t k = 0; k < shape.modes; ++k)
          x += double{shape.rows[r * shape.modes + k]} * double{shape.scale[k]} / shape.largest *
               shape.basis[k * rest.size() + i];
        square += (x - double{rows[r][i]}) * (x - double{rows[r][i]});
      }
      largest = std::max(largest, std::sqrt(square));
    }
  }
  return largest;
}

constexpr double kFloat = 2e-6;  // of positions of about a metre, computed in float32

TEST(PageShape, IsAsPreciseAsItSays) {
  const std::vector<float> rest = RandomPoints(120, 1, 1);
  const Rows rows = Waves(rest, 60, 6);
  for (const double wanted : {1e-2, 1e-3, 1e-4, 1e-5}) {
    const Result<PageShape> shape = FitShape(rest, Spans(rows), wanted, {});
    ASSERT_TRUE(shape.ok());
    EXPECT_EQ(shape->largest, 127);
    EXPECT_LE(shape->precision, wanted);
    EXPECT_NEAR(LargestDistance(*shape, rest, rows), shape->precision, kFloat);
    ASSERT_EQ(shape->basis.size(), shape->modes * rest.size());
    ASSERT_EQ(shape->scale.size(), shape->modes);
    ASSERT_EQ(shape->rows.size(), shape->modes * rows.size());
    for (const std::int16_t number : shape->basis) EXPECT_LE(std::abs(number), shape->largest);
    // Another number is another shape: the comparison above can fail
    PageShape other = *shape;
    other.basis[7] = static_cast<std::int16_t>(other.basis[7] > 0 ? -120 : 120);
    EXPECT_GT(LargestDistance(other, rest, rows), 2 * wanted);
  }
}

TEST(PageShape, TakesFewModes) {
  const std::vector<float> rest = RandomPoints(200, 1, 2);
  const Rows rows = Waves(rest, 80, 3);
  const Result<PageShape> coarse = FitShape(rest, Spans(rows), 2e-2, {}),
                          fine = FitShape(rest, Spans(rows), 1e-5, {});
  ASSERT_TRUE(coarse.ok() && fine.ok());
  // Three motions; each may be followed by corrections of a hundredth of it
  EXPECT_LE(coarse->modes, 4u);
  EXPECT_GT(fine->modes, coarse->modes);
  EXPECT_LE(fine->modes, 9u);
}

TEST(PageShape, OfWhatStandsStillIsTheRestShape) {
  const std::vector<float> rest = RandomPoints(50, 1, 3);
  const Result<PageShape> shape = FitShape(rest, Spans(Rows(10, rest)), 1e-5, {});
  ASSERT_TRUE(shape.ok());
  EXPECT_EQ(shape->modes, 1u);
  EXPECT_EQ(shape->precision, 0);
  EXPECT_EQ(ShapePositions(*shape, rest, 4), rest);
}

// More rows than components are looked for at once, one of them like no other.
TEST(PageShape, SeesRowsThatAreLikeNoOther) {
  const std::vector<float> rest = RandomPoints(40, 1, 4);
  Rows rows = Waves(rest, 1500, 2);
  rows[777][50] += 0.2f;
  const Result<PageShape> shape = FitShape(rest, Spans(rows), 1e-4, {});
  ASSERT_TRUE(shape.ok());
  EXPECT_LE(shape->precision, 1e-4);
  EXPECT_NEAR(LargestDistance(*shape, rest, rows), shape->precision, kFloat);
}

TEST(PageShape, SaysHowFarItIsWhereNoModesAreEnough) {
  const std::vector<float> rest = RandomPoints(150, 1, 5);
  Rows rows;
  for (std::size_t r = 0; r < 320; ++r) rows.push_back(RandomPoints(150, 0.1, 10 + r));
  const Result<PageShape> shape = FitShape(rest, Spans(rows), 1e-6, {});
  ASSERT_TRUE(shape.ok());
  EXPECT_EQ(shape->modes, kMostPageModes);
  EXPECT_GT(shape->precision, 1e-2);
  EXPECT_NEAR(LargestDistance(*shape, rest, rows), shape->precision, kFloat);
}

TEST(PageShape, EndsWhereSomebodyCancels) {
  const std::vector<float> rest = RandomPoints(20, 1, 6);
  std::atomic<bool> cancel = true;
  Watch watch;
  watch.cancel = &cancel;
  const Result<PageShape> shape = FitShape(rest, Spans(Waves(rest, 10, 2)), 1e-6, watch);
  ASSERT_FALSE(shape.ok());
  EXPECT_EQ(shape.status().kind(), ErrorKind::kInterrupted);
}

double LargestRemainder(const PageResidual& residual, const Rows& full, const Rows& accelerated) {
  double largest = 0;
  for (std::size_t f = 0; f < full.size(); ++f) {
    for (std::size_t i = 0; i < full[f].size(); ++i) {
      const int row = residual.frame_rows[f];
      const double stored =
          row < 0 ? 0 : residual.step * residual.values[static_cast<std::size_t>(row) * full[f].size() + i];
      largest = std::max(largest, std::abs(double{full[f][i]} - double{accelerated[f][i]} - stored));
    }
  }
  return largest;
}

TEST(PageResidual, IsRightToHalfAStep) {
  const Rows full(3, RandomPoints(30, 1, 7));
  Rows accelerated = full;
  accelerated[0][5] += 0.01f, accelerated[2][80] -= 0.02f;
  const PageResidual residual = FitResidual(Spans(full), Spans(accelerated), 3e-4);
  EXPECT_EQ(residual.step, 3e-4);
  EXPECT_FALSE(residual.wide);
  EXPECT_EQ(residual.frame_rows, (std::vector<int>{0, -1, 1}));
  EXPECT_EQ(residual.values.size(), 2 * full[0].size());
  EXPECT_EQ(residual.values[5], -33);
  EXPECT_LE(LargestRemainder(residual, full, accelerated), 0.5 * residual.step + 1e-9);
}

TEST(PageResidual, GrowsWithTheDifference) {
  const Rows full(1, RandomPoints(10, 1, 8));
  Rows accelerated = full;
  accelerated[0][3] += 1.0f;
  const PageResidual wide = FitResidual(Spans(full), Spans(accelerated), 1e-3);
  EXPECT_TRUE(wide.wide);
  EXPECT_EQ(wide.step, 1e-3);
  EXPECT_LE(LargestRemainder(wide, full, accelerated), 0.5 * wide.step + 1e-9);
  const PageResidual coarser = FitResidual(Spans(full), Spans(accelerated), 1e-6);
  EXPECT_GT(coarser.step, 1e-6);
  EXPECT_EQ(coarser.values[3], -32767);
  EXPECT_LE(LargestRemainder(coarser, full, accelerated), 0.5 * coarser.step + 1e-9);
}

}  // namespace
}  // namespace kpsa::engine
