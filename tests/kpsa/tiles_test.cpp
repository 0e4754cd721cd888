#include "kpsa/tiles.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

#include "base/simd.h"
#include "kpsa/rigid_points.h"
#include "kpsa/training/eigen_solvers.h"
#include "kpsa/training/tile_builder.h"
#include "tests/kpsa/dense_map.h"

namespace kpsa::engine {
namespace {

// A map whose tiles have a falling spectrum, as neighbours that move alike give: gain [cN x r].
Eigen::MatrixXd SmoothGain(std::size_t points, int components, Eigen::Index inputs, std::uint64_t seed) {
  const Eigen::MatrixXd directions = RandomNormal(components, inputs, seed),
                        phases = RandomNormal(3, inputs, seed + 1);
  Eigen::MatrixXd gain(static_cast<Eigen::Index>(points) * components, inputs);
  for (std::size_t i = 0; i < points; ++i) {
    const double s = static_cast<double>(i) / 128;
    for (Eigen::Index k = 0; k < inputs; ++k) {
      const double wave = std::sin(phases(0, k) * s + phases(1, k)) * std::exp(phases(2, k) * 0.2);
      for (int c = 0; c < components; ++c)
        gain(static_cast<Eigen::Index>(i) * components + c, k) = 1e-3 * directions(c, k) * wave;
    }
  }
  return gain;
}

std::vector<float> RandomInputs(std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal;
  std::vector<float> values(count);
  for (float& value : values) value = normal(random);
  return values;
}

// One component array after the other, padding included.
std::vector<float> Bytes(const PointsView& view, int components) {
  std::vector<float> all;
  for (const float* array : {view.x, view.y, view.z}) {
    if (components-- > 0) all.insert(all.end(), array, array + view.count);
  }
  return all;
}

float Half(const AlignedArray<std::uint16_t>& halfs, std::size_t at) {
  return FloatFromHalf(halfs.data()[at]);
}

// The definition, value by value.
std::vector<float> NaiveTwin(const TileMap& map, std::span<const float> y) {
  const TileData& d = map.data();
  const auto c = static_cast<std::size_t>(d.components);
  const std::size_t rows = 32 * c;
  std::vector<float> out(d.points * c);
  std::size_t column_at = 0, scale_at = 0, v_at = 0, u_at = 0;
  for (std::size_t t = 0; t < map.tiles(); ++t) {
    const std::size_t rank = d.ranks[t], wide = d.wide[t], cues = d.counts[t], k16 = (rank + 15) / 16 * 16;
    const std::size_t first = t * kTilePoints, count = std::min(kTilePoints, d.points - first);
    // z, and what meets the bytes
    std::vector<float> inputs(wide);
    for (std::size_t k = 0; k < rank; ++k) {
      float z;
      if (d.direct[t] == 1) {
        z = y[d.columns[column_at + k]] * d.scale.data()[scale_at + k];
      } else {
        float sums[4] = {0, 0, 0, 0};
        for (std::size_t j = 0; j < cues; ++j)
          sums[j % 4] = std::fma(Half(d.v, v_at + j * k16 + k), y[d.columns[column_at + j]], sums[j % 4]);
        z = ((sums[0] + sums[1]) + (sums[2] + sums[3])) * d.scale.data()[scale_at + k];
      }
      if (k < wide) inputs[k] = 256.0f * z;
      inputs.push_back(z);
    }
    float largest = 0;
    for (const float input : inputs) largest = std::max(largest, std::fabs(input));
    const float step = largest / 32639.0f, inverse = largest > 0 ? 32639.0f / largest : 0;
    std::vector<std::int64_t> q;
    for (const float input : inputs) q.push_back(std::lrint(input * inverse));
    const std::size_t groups = (inputs.size() + 3) / 4;
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t x = 0; x < c; ++x) {
        std::int64_t sum = 0;
        for (std::size_t k = 0; k < inputs.size(); ++k) {
          const std::size_t place[4] = {0, 2, 1, 3};
          const std::size_t at =
              u_at + ((i / 32 * groups + k / 4) * rows + x * 32 + i % 32) * 4 + place[k % 4];
          sum += (static_cast<std::int64_t>(d.u.data()[at]) - 128) * q[k];
        }
        out[x * d.points + first + i] =
            std::fma(static_cast<float>(sum), step, d.mean.data()[(first + i) / 32 * rows + x * 32 + i % 32]);
      }
    }
    column_at += cues;
    scale_at += k16;
    v_at += d.direct[t] == 1 ? 0 : cues * k16;
    u_at += (count + 31) / 32 * groups * rows * 4;
  }
  return out;
}

TEST(Half, EveryHalfComesBackAndRoundingIsToNearestEven) {
  for (std::uint32_t h = 0; h < 65536; ++h) {
    const float value = FloatFromHalf(static_cast<std::uint16_t>(h));
    if (std::isnan(value)) continue;
    EXPECT_EQ(HalfFromFloat(value), h);
  }
  EXPECT_EQ(FloatFromHalf(0x3c00), 1.0f);
  EXPECT_EQ(FloatFromHalf(0x0001), std::ldexp(1.0f, -24));
  EXPECT_EQ(FloatFromHalf(0x7bff), 65504.0f);
  // Every midpoint of two neighbours goes to the even one, everything else to the nearer
  for (std::uint32_t h = 0; h < 0x7bff; ++h) {
    const float low = FloatFromHalf(static_cast<std::uint16_t>(h)),
                high = FloatFromHalf(static_cast<std::uint16_t>(h + 1));
    const float middle = 0.5f * (low + high);
    EXPECT_EQ(HalfFromFloat(middle), h % 2 == 0 ? h : h + 1);
    EXPECT_EQ(HalfFromFloat(std::nextafter(middle, 0.0f)), h);
    EXPECT_EQ(HalfFromFloat(std::nextafter(middle, 1e9f)), h + 1);
  }
  EXPECT_EQ(HalfFromFloat(70000.0f), 0x7c00);
  EXPECT_EQ(HalfFromFloat(-INFINITY), 0xfc00);
  EXPECT_TRUE(std::isnan(FloatFromHalf(HalfFromFloat(std::nanf("")))));
}

struct Shape {
  std::size_t points;
  int components;
  Eigen::Index inputs;
};

TEST(Tiles, EveryTargetGivesTheBitsOfTheNaiveTwin) {
  for (const Shape& shape : {Shape{1, 3, 3}, Shape{40, 3, 9}, Shape{128, 3, 30}, Shape{333, 3, 60},
                             Shape{1000, 3, 45}, Shape{300, 1, 24}}) {
    const TileMap map =
        BuildTiles(SmoothGain(shape.points, shape.components, shape.inputs, 1),
                   RandomNormal(static_cast<Eigen::Index>(shape.points) * shape.components, 1, 2),
                   shape.components, {}, {.rms_budget = 1e-5});
    if (shape.points > 100 && shape.components == 3) {
      EXPECT_GT(*std::max_element(map.data().wide.begin(), map.data().wide.end()), 0u);
      EXPECT_LT(map.data().wide[0], map.data().ranks[0]);
    }
    const std::vector<float> w = RandomInputs(map.inputs(), 3), twin = NaiveTwin(map, w);
    for (const char* target : {"avx512", "avx2", "scalar"}) {
      if (!SelectSimdTarget(target)) continue;
      PointBuffer out(shape.points, shape.components);
      map.Reconstruct(w, out.view());
      EXPECT_EQ(Bytes(out.view(), shape.components), twin) << target << " " << shape.points;
    }
    SelectSimdTarget("");
  }
}

TEST(Tiles, BlocksOfFramesAndListsOfTilesGiveTheSameBits) {
  const std::size_t points = 700;
  const TileMap map =
      BuildTiles(SmoothGain(points, 3, 40, 4), RandomNormal(2100, 1, 5), 3, {}, {.rms_budget = 1e-5});
  ASSERT_EQ(map.tiles(), 6u);
  for (const char* target : {"avx512", "avx2", "scalar"}) {
    if (!SelectSimdTarget(target)) continue;
    for (const std::size_t frames : {1, 2, 3, 4, 5, 9}) {
      const std::vector<float> w = RandomInputs(frames * 40, 6);
      for (const std::vector<Index>& tiles : {std::vector<Index>{}, {0}, {2, 3, 5}, {1, 4}}) {
        std::vector<PointBuffer> outs;
        std::vector<PointsView> views;
        for (std::size_t f = 0; f < frames; ++f) outs.emplace_back(points);
        for (PointBuffer& out : outs) views.push_back(out.view());
        map.ReconstructBlock(w, views, tiles);
        for (std::size_t f = 0; f < frames; ++f) {
          const std::vector<float> twin = NaiveTwin(map, {w.data() + f * 40, 40}), got = Bytes(views[f], 3);
          for (std::size_t i = 0; i < got.size(); ++i) {
            const bool wanted = tiles.empty() || std::find(tiles.begin(), tiles.end(),
                                                           i % points / kTilePoints) != tiles.end();
            ASSERT_EQ(got[i], wanted ? twin[i] : 0.0f) << target << " frame " << f << " value " << i;
          }
        }
      }
    }
  }
  SelectSimdTarget("");
}

TEST(Tiles, StayWithinTheBudgetOfTheDenseMap) {
  for (const double budget : {1e-3, 1e-4, 1e-5}) {
    const std::size_t points = 600;
    const Eigen::MatrixXd gain = SmoothGain(points, 3, 80, 7);
    const Eigen::VectorXd mean = RandomNormal(1800, 1, 8);
    TileReport report;
    const TileMap map = BuildTiles(gain, mean, 3, {}, {.rms_budget = budget}, &report);
    const DenseMap dense(gain, mean, 3);
    EXPECT_LE(report.worst_tile_rms, budget);
    double sum = 0;
    constexpr int kFrames = 300;
    PointBuffer a(points), b(points);
    for (unsigned f = 0; f < kFrames; ++f) {
      const std::vector<float> w = RandomInputs(80, 100 + f);
      map.Reconstruct(w, a.view());
      dense.Reconstruct(w, b.view());
      const std::vector<float> x = Bytes(a.view(), 3), y = Bytes(b.view(), 3);
      for (std::size_t i = 0; i < x.size(); ++i)
        sum += std::pow(static_cast<double>(x[i]) - static_cast<double>(y[i]), 2);
    }
    EXPECT_NEAR(std::sqrt(sum / (kFrames * static_cast<double>(points))) / report.rms, 1, 0.1) << budget;
    EXPECT_LT(map.bytes(), dense.bytes() / 4);
  }
}

TEST(Tiles, DenseMapAgreesWithTheFormula) {
  const Eigen::MatrixXd gain = RandomNormal(3 * 77, 10, 9);
  const Eigen::VectorXd mean = RandomNormal(3 * 77, 1, 10);
  const std::vector<float> w = RandomInputs(10, 11);
  const Eigen::VectorXd expected =
      mean + gain * Eigen::Map<const Eigen::VectorXf>(w.data(), 10).cast<double>();
  std::vector<float> first;
  for (const char* target : {"avx512", "avx2", "scalar"}) {
    if (!SelectSimdTarget(target)) continue;
    PointBuffer out(77);
    DenseMap(gain, mean, 3).Reconstruct(w, out.view());
    const std::vector<float> xyz = out.Interleaved();
    for (std::size_t i = 0; i < xyz.size(); ++i)
      EXPECT_NEAR(xyz[i], expected[static_cast<Eigen::Index>(i)], 3e-6);
    if (first.empty()) first = xyz;
    EXPECT_EQ(xyz, first) << target;
  }
  SelectSimdTarget("");
}

TEST(Tiles, RankFollowsTheMotion) {
  // A tile that does not move, one of rank one, one of noise (stored directly), and a short last one
  Eigen::MatrixXd gain = Eigen::MatrixXd::Zero(3 * 400, 12);
  gain.middleRows(3 * 128, 3 * 128) = 1e-3 * RandomNormal(384, 1, 12) * RandomNormal(1, 12, 13);
  gain.middleRows(3 * 256, 3 * 128) = 1e-3 * RandomNormal(384, 12, 14);
  gain.bottomRows(3 * 16) = 1e-3 * RandomNormal(48, 2, 15) * RandomNormal(2, 12, 16);
  TileReport report;
  const TileMap map = BuildTiles(gain, Eigen::VectorXd::Zero(1200), 3, {}, {.rms_budget = 1e-5}, &report);
  EXPECT_EQ(map.data().ranks, (std::vector<std::uint32_t>{0, 1, 12, 2}));
  EXPECT_EQ(map.data().direct, (std::vector<std::uint8_t>{0, 0, 1, 0}));
  EXPECT_EQ(report.direct_tiles, 1u);
  const std::vector<float> w = RandomInputs(12, 17);
  PointBuffer out(400);
  map.Reconstruct(w, out.view());
  EXPECT_EQ(Bytes(out.view(), 3), NaiveTwin(map, w));
  for (std::size_t i = 0; i < 128; ++i) EXPECT_EQ(out.view().x[i], 0.0f);
}

TEST(Tiles, TinyUnitsKeepTheirDigits) {
  // Micrometres in metres: without the scale a column, halfs would underflow
  const Eigen::MatrixXd gain = 1e-6 * SmoothGain(256, 3, 20, 18);
  TileReport report;
  BuildTiles(gain, Eigen::VectorXd::Zero(768), 3, {}, {.rms_budget = 1e-12}, &report);
  EXPECT_LE(report.worst_tile_rms, 2e-12);
}

TEST(Tiles, RareButLargeMotionIsKeptWhereSamplesShowIt) {
  // Two inputs that hardly ever act, each on its own ten points
  Eigen::MatrixXd gain = SmoothGain(256, 3, 20, 20);
  gain.block(30, 18, 30, 1).setConstant(0.02);
  gain.block(450, 19, 30, 1).setConstant(0.02);
  TileInputs inputs{Eigen::MatrixXd::Identity(20, 20), Eigen::MatrixXd::Zero(20, 30), {}};
  inputs.covariance(18, 18) = inputs.covariance(19, 19) = 1e-6;
  for (Eigen::Index i = 0; i < 28; ++i)
    inputs.samples.col(i).head(18) = RandomNormal(18, 1, 30 + static_cast<std::uint64_t>(i));
  inputs.samples(18, 28) = inputs.samples(19, 29) = 1;
  TileReport loose, strict;
  const Eigen::VectorXd mean = Eigen::VectorXd::Zero(768);
  BuildTiles(gain, mean, 3, inputs, {.rms_budget = 1e-4}, &loose);
  const TileMap map = BuildTiles(gain, mean, 3, inputs, {.rms_budget = 1e-4, .max_budget = 4e-4}, &strict);
  EXPECT_GT(loose.largest, 0.02);
  EXPECT_LE(strict.largest, 4e-4);
  EXPECT_LE(strict.worst_tile_rms, 1e-4);

  // What the report says is what the kernel does
  double largest = 0;
  PointBuffer out(256);
  for (Eigen::Index i = 0; i < 30; ++i) {
    const Eigen::VectorXf y = inputs.samples.col(i).cast<float>();
    map.Reconstruct({y.data(), 20}, out.view());
    const std::vector<float> xyz = out.Interleaved();
    const Eigen::VectorXd error =
        Eigen::Map<const Eigen::VectorXf>(xyz.data(), 768).cast<double>() - gain * inputs.samples.col(i);
    for (Eigen::Index p = 0; p < 256; ++p) largest = std::max(largest, error.segment(3 * p, 3).norm());
  }
  EXPECT_NEAR(largest / strict.largest, 1, 0.02);
}

TEST(Tiles, ASpaceAppliesToEveryPointOnce) {
  const std::size_t points = 300;
  const TileMap map =
      BuildTiles(SmoothGain(points, 3, 20, 21), RandomNormal(900, 1, 22), 3, {}, {.rms_budget = 1e-5});
  Matrix4 space;
  space(0, 1) = 0.5;
  space(2, 3) = 7;
  const std::vector<float> y = RandomInputs(20, 23);
  PointBuffer through(points), after(points), tile(points);
  map.Reconstruct(y, through.view(), &space);
  map.Reconstruct(y, after.view());
  TransformPoints(ToFloats(space), after.view());
  EXPECT_EQ(through.Interleaved(), after.Interleaved());
  const std::vector<Index> last = {2};
  const PointsView to = tile.view();
  map.ReconstructBlock(y, {&to, 1}, last, {&space, 1});
  EXPECT_EQ(tile.view().z[299], after.view().z[299]);
  EXPECT_EQ(tile.view().z[255], 0);
}

TEST(Tiles, NotFiniteInputsSpoilThePointsThatReadThem) {
  Eigen::MatrixXd gain = Eigen::MatrixXd::Zero(3 * 256, 2);
  gain.block(0, 0, 384, 1).setConstant(1e-3);
  gain.block(384, 1, 384, 1).setConstant(1e-3);
  const TileMap map = BuildTiles(gain, Eigen::VectorXd::Zero(768), 3, {}, {.rms_budget = 1e-6});
  for (const float bad : {std::nanf(""), INFINITY, -INFINITY}) {
    for (const char* target : {"avx512", "avx2", "scalar"}) {
      if (!SelectSimdTarget(target)) continue;
      PointBuffer out(256);
      const std::vector<float> y = {bad, 1};
      map.Reconstruct(y, out.view());
      for (std::size_t i = 0; i < 256; ++i)
        EXPECT_EQ(std::isnan(out.view().y[i]), i < 128) << target << " " << i;
    }
    SelectSimdTarget("");
  }
}

TEST(Tiles, InconsistentDataAreRefused) {
  const auto make = [](auto change) {
    const TileMap map =
        BuildTiles(SmoothGain(200, 3, 20, 19), Eigen::VectorXd::Zero(600), 3, {}, {.rms_budget = 1e-5});
    TileData data = map.data();
    change(&data);
    const Result<TileMap> result = TileMap::Make(std::move(data), "a.kpsa");
    return result.ok() ? std::string() : result.status().ToString();
  };
  EXPECT_EQ(make([](TileData*) {}), "");
  EXPECT_NE(make([](TileData* d) { d->ranks.pop_back(); }).find("1 ranks"), std::string::npos);
  EXPECT_NE(make([](TileData* d) { d->ranks[0] = 21; }).find("rank 21"), std::string::npos);
  EXPECT_NE(make([](TileData* d) { d->ranks[0] += 16; }).find("expected"), std::string::npos);
  EXPECT_NE(make([](TileData* d) { d->direct[1] = 7; }).find("tile 1"), std::string::npos);
  EXPECT_NE(make([](TileData* d) { d->components = 2; }).find("2 components"), std::string::npos);
  EXPECT_NE(make([](TileData* d) { d->points = 100; }).find("tiles"), std::string::npos);
  EXPECT_NE(make([](TileData* d) { d->wide[0] = d->ranks[0] + 1; }).find("wide"), std::string::npos);
  EXPECT_NE(make([](TileData* d) { d->columns[0] = 20; }).find("cue row 20 of 20"), std::string::npos);
  EXPECT_NE(make([](TileData* d) { d->u = AlignedArray<std::uint8_t>(5); }).find("expected"),
            std::string::npos);
}

// What the modes leave out of a tile makes that tile coarser, and no other.
TEST(Tiles, ATileStoresNoFinerThanWhatIsLeftOutOfIt) {
  const Eigen::MatrixXd gain = SmoothGain(2 * kTilePoints, 3, 40, 5);
  const Eigen::VectorXd mean = Eigen::VectorXd::Zero(gain.rows());
  TileInputs inputs;
  inputs.left_out = Eigen::VectorXd::Zero(gain.rows());
  inputs.left_out.tail(gain.rows() / 2).setConstant(1e-8);  // RMS of a point: 1.7e-4
  TileOptions options{1e-5, std::numeric_limits<double>::infinity(), 0};
  TileReport fine, coarse;
  const TileMap before = BuildTiles(gain, mean, 3, inputs, options, &fine);
  options.left_out_share = 0.25;
  const TileMap after = BuildTiles(gain, mean, 3, inputs, options, &coarse);
  ASSERT_EQ(after.tiles(), 2u);
  EXPECT_EQ(after.data().ranks[0], before.data().ranks[0]);
  EXPECT_EQ(after.data().counts[0], before.data().counts[0]);
  EXPECT_LT(after.data().ranks[1], before.data().ranks[1]);
  EXPECT_LT(after.bytes(), before.bytes());
  EXPECT_LE(fine.worst_tile_rms, 1e-5);
  EXPECT_GT(coarse.worst_tile_rms, 1e-5);
  EXPECT_LE(coarse.worst_tile_rms, 0.25 * std::sqrt(3e-8));
}

}  // namespace
}  // namespace kpsa::engine
