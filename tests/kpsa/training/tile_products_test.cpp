#include "kpsa/training/tile_products.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/simd.h"
#include "kpsa/tiles.h"
#include "kpsa/training/eigen_solvers.h"
#include "kpsa/training/score_choice.h"
#include "kpsa/training/tile_builder.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kPointsOfSheet = 300;
constexpr Eigen::Index kInputs = 6;

// Points that move with the inputs, and with products of them, in waves along their order.
class Bent {
 public:
  explicit Bent(double bend)
      : linear_(Waves(kInputs, 3, 1e-2)), quadratic_(Waves(kInputs, 40, bend)), poses_(Layout()) {
    measured_ = RandomNormal(kInputs, 900, 5);
    for (Eigen::Index t = 0; t < measured_.cols(); ++t) {
      const Eigen::VectorXd f = At(measured_.col(t));
      std::copy(f.data(), f.data() + f.size(), poses_.AddPose().begin());
    }
    mean_ = poses_.Mean();
    poses_.Subtract(mean_);
  }

  // f [3N]
  Eigen::VectorXd At(const Eigen::VectorXd& y) const {
    Eigen::VectorXd product(kInputs);
    for (Eigen::Index i = 0; i < kInputs; ++i) product[i] = y[i] * y[(i + 1) % kInputs];
    return linear_ * y + quadratic_ * product;
  }
  TileMap Tiles(bool products, double tolerance = 1e-4) const {
    TileInputs inputs;
    inputs.samples = measured_.leftCols(100);
    if (products) inputs.poses = &poses_, inputs.measured = &measured_;
    return BuildTiles(linear_, mean_, 3, inputs, {.rms_budget = 0.05 * tolerance, .max_budget = tolerance});
  }
  // The largest point error of a pose.
  double Error(const TileMap& map, const Eigen::VectorXd& y) const {
    const Eigen::VectorXf in = y.cast<float>();
    PointBuffer out(kPointsOfSheet);
    map.Reconstruct({in.data(), static_cast<std::size_t>(kInputs)}, out.view());
    const std::vector<float> xyz = out.Interleaved();
    const Eigen::VectorXd error =
        Eigen::Map<const Eigen::VectorXf>(xyz.data(), 3 * kPointsOfSheet).cast<double>() - At(y);
    return std::sqrt(Eigen::Map<const Eigen::MatrixXd>(error.data(), 3, kPointsOfSheet)
                         .colwise()
                         .squaredNorm()
                         .maxCoeff());
  }

 private:
  static PoseLayout Layout() {
    PoseLayout layout;
    layout.points = kPointsOfSheet;
    return layout;
  }
  static Eigen::MatrixXd Waves(Eigen::Index columns, std::uint64_t seed, double size) {
    const Eigen::MatrixXd random = RandomNormal(3, columns, seed);
    Eigen::MatrixXd waves(3 * static_cast<Eigen::Index>(kPointsOfSheet), columns);
    for (Eigen::Index i = 0; i < waves.rows(); ++i) {
      for (Eigen::Index k = 0; k < columns; ++k)
        waves(i, k) =
            size * random(i % 3, k) * std::sin(0.01 * static_cast<double>((i / 3) * (k + 1)) + random(0, k));
    }
    return waves;
  }

  Eigen::MatrixXd linear_, quadratic_, measured_;
  PoseMatrix poses_;
  Eigen::VectorXd mean_;
};

double LargestDoubtOf(const TileMap& map, const Eigen::VectorXd& y) {
  const Eigen::VectorXf in = y.cast<float>();
  std::vector<float> inputs(map.input_size());
  return static_cast<double>(
      map.ComputeInputs({in.data(), static_cast<std::size_t>(kInputs)}, inputs).largest);
}

TEST(TileProducts, FollowABendThatNoLinearMapCan) {
  const Bent bent(2e-3);
  const TileMap linear = bent.Tiles(false), products = bent.Tiles(true);
  EXPECT_FALSE(linear.has_products());
  ASSERT_TRUE(products.has_products());
  const Eigen::MatrixXd fresh = RandomNormal(kInputs, 200, 77);
  double without = 0, with = 0;
  for (Eigen::Index t = 0; t < fresh.cols(); ++t) {
    without += bent.Error(linear, fresh.col(t));
    with += bent.Error(products, fresh.col(t));
  }
  EXPECT_LT(with, 0.4 * without);  // as far as 15 products of 21 can
}

TEST(TileProducts, TheDoubtIsWhatTheLinearMapIsOffBy) {
  const Bent bent(2e-3);
  const TileMap linear = bent.Tiles(false), products = bent.Tiles(true);
  const Eigen::MatrixXd fresh = RandomNormal(kInputs, 300, 78);
  Eigen::ArrayXd doubts(fresh.cols()), errors(fresh.cols());
  for (Eigen::Index t = 0; t < fresh.cols(); ++t) {
    doubts[t] = LargestDoubtOf(products, fresh.col(t));
    errors[t] = bent.Error(linear, fresh.col(t));
  }
  const Eigen::ArrayXd d = doubts - doubts.mean(), e = errors - errors.mean();
  EXPECT_GT((d * e).sum() / std::sqrt(d.square().sum() * e.square().sum()), 0.9);
  EXPECT_NEAR(doubts.mean() / errors.mean(), 1, 0.2);
}

TEST(TileProducts, DoubtsMayCountForLess) {
  const Bent bent(2e-3);
  const TileMap tiles = bent.Tiles(true);
  std::vector<double> factors;
  for (std::size_t t = 0; t < tiles.tiles(); ++t) factors.push_back(t % 2 == 0 ? 0.5 : 0.125);
  const TileMap believed = tiles.WithDoubts(factors);
  const Eigen::VectorXf y = RandomNormal(kInputs, 1, 79).cast<float>();
  const std::span<const float> in(y.data(), static_cast<std::size_t>(kInputs));
  std::vector<float> inputs(tiles.input_size()), of(tiles.input_size()), doubts(tiles.tiles()),
      fewer(tiles.tiles());
  tiles.ComputeInputs(in, inputs, doubts);
  believed.ComputeInputs(in, of, fewer);
  ASSERT_GT(doubts[0], 0);
  for (std::size_t t = 0; t < tiles.tiles(); ++t)
    EXPECT_EQ(fewer[t], static_cast<float>(factors[t]) * doubts[t]) << "powers of two are exact";
  EXPECT_EQ(of, inputs) << "and points are the same";
}

TEST(TileProducts, NoneWhereTheLinearMapIsGoodEnough) {
  EXPECT_FALSE(Bent(0).Tiles(true).has_products());
  EXPECT_FALSE(Bent(1e-7).Tiles(true).has_products());
}

float HalfAt(const AlignedArray<std::uint16_t>& halfs, std::size_t at) {
  return FloatFromHalf(halfs.data()[at]);
}
// sum_j matrix[j][row] of[j], in the order of the kernel.
float NaiveRow(const AlignedArray<std::uint16_t>& matrix, std::size_t begin, std::size_t height,
               std::size_t row, const std::vector<float>& of) {
  float sums[4] = {0, 0, 0, 0};
  for (std::size_t j = 0; j < of.size(); ++j)
    sums[j % 4] = std::fma(HalfAt(matrix, begin + j * height + row), of[j], sums[j % 4]);
  return (sums[0] + sums[1]) + (sums[2] + sums[3]);
}

TEST(TileProducts, EveryTargetGivesTheInputsOfTheNaiveTwin) {
  const TileMap map = Bent(2e-3).Tiles(true);
  const TileData& d = map.data();
  const Eigen::VectorXf y = RandomNormal(kInputs, 1, 9).cast<float>();
  std::vector<float> twin;
  float doubt = 0;
  std::size_t column = 0, v = 0, w = 0, at = 0, pair = 0, white = 0;
  for (std::size_t t = 0; t < map.tiles(); ++t) {
    const std::size_t k16 = (d.ranks[t] + 15) / 16 * 16, first = twin.size(), count = d.products[t];
    ASSERT_EQ(d.direct[t], 0);
    std::vector<float> cues, z(16, 0.0f), p;
    for (std::size_t j = 0; j < d.counts[t]; ++j) cues.push_back(y[d.columns[column + j]]);
    for (std::size_t k = 0; k < k16; ++k)
      twin.push_back(NaiveRow(d.v, v, k16, k, cues) * d.scale.data()[first + k]);
    if (count > 0) {
      for (std::size_t i = 0; i < 15; ++i)
        z[i] = std::clamp(twin[first + i] * d.whitening.data()[white + i], -kLatentClip, kLatentClip);
      z[kUnitLatent] = 1;
      for (std::size_t q = 0; q < count; ++q)
        p.push_back(z[d.pairs[pair + 2 * q]] * z[d.pairs[pair + 2 * q + 1]]);
      for (std::size_t k = 0; k < k16; ++k)
        twin[first + k] = twin[first + k] + NaiveRow(d.w, w, k16, k, p) * d.scale.data()[first + k];
      for (std::size_t i = 0; i < kDoubtPoints; ++i) {
        float square = 0;
        for (std::size_t c = 0; c < 3; ++c) {
          const float term =
              NaiveRow(d.doubt, at, 16, c * kDoubtPoints + i, p) * d.whitening.data()[white + 16];
          square = square + term * term;
        }
        doubt = std::max(doubt, square);
      }
      pair += 2 * count, w += count * k16, at += 16 * count, white += 32;
    }
    column += d.counts[t], v += d.counts[t] * k16;
  }
  for (const char* target : {"avx512", "avx2", "scalar"}) {
    if (!SelectSimdTarget(target)) continue;
    std::vector<float> inputs(map.input_size());
    const Doubt found = map.ComputeInputs({y.data(), static_cast<std::size_t>(kInputs)}, inputs);
    EXPECT_EQ(inputs, twin) << target;
    EXPECT_EQ(found.largest, std::sqrt(doubt)) << target;
    // Points from these inputs are those from y
    PointBuffer a(kPointsOfSheet), b(kPointsOfSheet);
    map.Reconstruct({y.data(), static_cast<std::size_t>(kInputs)}, a.view());
    const float* const from = inputs.data();
    const PointsView view = b.view();
    map.ReconstructFrom({&from, 1}, {&view, 1}, {});
    EXPECT_EQ(a.Interleaved(), b.Interleaved()) << target;
  }
  SelectSimdTarget("");
}

TEST(TileProducts, InconsistentDataAreRefused) {
  const TileMap map = Bent(2e-3).Tiles(true);
  const auto make = [&](auto change) {
    TileData data = map.data();
    change(&data);
    const Result<TileMap> result = TileMap::Make(std::move(data), "a.kpsa");
    return result.ok() ? std::string("fine") : result.status().ToString();
  };
  EXPECT_EQ(make([](TileData*) {}), "fine");
  const auto refused = [&](auto change, const std::string& part) {
    EXPECT_NE(make(change).find(part), std::string::npos) << make(change);
  };
  refused([](TileData* d) { d->products.pop_back(); }, "tile 2 has rank");
  refused([](TileData* d) { d->products.push_back(0); }, "numbers of products");
  refused([](TileData* d) { d->products[0] = 80; }, "80 products");
  refused([](TileData* d) { ++d->products[0]; }, "expected");
  refused([](TileData* d) { d->pairs[3] = 14; }, "product of latent 14");
  refused([](TileData* d) { d->pairs.pop_back(); }, "expected");
  refused([](TileData* d) { d->w = AlignedArray<std::uint16_t>(3); }, "expected");
  refused([](TileData* d) { d->doubt = {}; }, "expected");
  refused([](TileData* d) { d->whitening = {}; }, "expected");
  refused([](TileData* d) { d->products.clear(), d->ranks[0] = d->counts[0] + 1; }, "rank");
}

// Judges of which one part of the score tells those beyond the tolerance, and the other tells nothing.
std::vector<ScoreJudge> Judges(bool doubt_tells, std::uint64_t seed) {
  const Eigen::MatrixXd random = RandomNormal(2, 600, seed);
  std::vector<ScoreJudge> judges;
  for (Eigen::Index t = 0; t < random.cols(); ++t) {
    const double error = std::exp(random(0, t)), other = std::exp(random(1, t));
    judges.push_back({{doubt_tells ? other : error, doubt_tells ? error : other, error}, 0, 0});
  }
  return judges;
}

TEST(ScoreChoice, TakesThePartThatTells) {
  const ScoreMix doubt = ChooseScore(Judges(true, 3), 2, 0.05, 0.85, {}),
                 measured = ChooseScore(Judges(false, 4), 2, 0.05, 0.85, {});
  EXPECT_GT(doubt.doubt, 0);
  EXPECT_EQ(doubt.measured, 0);
  EXPECT_EQ(measured, ScoreMix());
  // Unless it costs more than it brings
  EXPECT_EQ(ChooseScore(Judges(true, 3), 2, 0.05, 0.85, {.measured = 0, .doubt = 2}), ScoreMix());
  std::vector<ScoreJudge> none = Judges(true, 5);
  for (ScoreJudge& judge : none) judge.pose.doubt = 0;
  EXPECT_EQ(ChooseScore(none, 2, 0.05, 0.85, {}), ScoreMix());
  EXPECT_EQ(ChooseScore({}, 2, 0.05, 0.85, {}), ScoreMix());
}

}  // namespace
}  // namespace kpsa::engine
