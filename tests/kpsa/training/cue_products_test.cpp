// Products of scalars as cues: three weights that act together, and one that begins at its half.
#include "kpsa/training/cue_products.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "kpsa/training/estimator.h"
#include "kpsa/training/pca.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kFacePoints = 40, kFaceScalars = 4, kReserved = 8;
constexpr double kFaceTolerance = 1e-4;

PoseLayout FaceLayout() {
  PoseLayout layout;
  layout.points = kFacePoints;
  layout.scalars = kFaceScalars + kReserved;
  layout.products = kReserved;
  layout.relative_begin = static_cast<Index>(layout.scalars);
  return layout;
}

// Weights in [0, 1]: each moves points; the first two more where they meet, the third more from its half on.
PoseMatrix FacePoses(std::size_t count, double together, double late, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  PoseMatrix poses(FaceLayout());
  for (std::size_t t = 0; t < count; ++t) {
    const double a = unit(random), b = unit(random), c = unit(random), idle = unit(random);
    const std::span<float> row = poses.AddPose();
    for (std::size_t i = 0; i < kFacePoints; ++i) {
      const double u = static_cast<double>(i) / kFacePoints;
      row[3 * i] = static_cast<float>(u + 0.01 * a * (1 - u) + 0.01 * b * u);
      row[3 * i + 1] = static_cast<float>(0.02 * c * u * (1 - u) + together * a * b * u);
      row[3 * i + 2] = static_cast<float>(0.01 * b * u * u + late * std::max(0.0, c - 0.5) * (1 - u));
    }
    const std::span<float> scalars = row.subspan(poses.layout().scalar_begin());
    const double values[] = {a, b, c, idle};
    for (std::size_t s = 0; s < kFaceScalars; ++s) scalars[s] = static_cast<float>(values[s]);
  }
  return poses;
}

std::vector<CueProduct> ChooseFor(const PoseMatrix& poses, bool hinges = true, std::size_t idle = 0) {
  CueProductOptions options;
  options.hinges = hinges;
  options.factors = {0, 1, 2, 3};
  options.regressors = options.factors;
  options.regressors.insert(options.regressors.end(), idle, 3);
  options.still.assign(poses.layout().scalars, 1e-5);
  options.tolerance = kFaceTolerance;
  options.most = kReserved;
  return ChooseCueProducts(poses, options);
}

void StoreAll(const std::vector<CueProduct>& products, PoseMatrix* poses) {
  for (std::size_t t = 0; t < poses->poses(); ++t) StoreProducts(products, poses->layout(), poses->row(t));
}

TEST(CueProducts, FindWhatActsTogetherAndWhatBeginsLate) {
  const std::vector<CueProduct> products = ChooseFor(FacePoses(1500, 0.01, 0.02, 1));
  bool together = false, late = false;
  for (const CueProduct& product : products) {
    together |= product.a == 0 && product.b == 1 && !product.of_a.hinge && !product.of_b.hinge;
    late |= product.a == 2 && product.b == kNoIndex && product.of_a.hinge &&
            std::fabs(product.of_a.centre - 0.5) < 0.02;
    EXPECT_NE(product.a, 3u) << "the idle weight";
    EXPECT_NE(product.b, 3u) << "the idle weight";
  }
  EXPECT_TRUE(together);
  EXPECT_TRUE(late);
}

TEST(CueProducts, HaveNoHingesWhereNoneAreWanted) {
  const std::vector<CueProduct> products = ChooseFor(FacePoses(1500, 0.01, 0.02, 1), false);
  EXPECT_FALSE(products.empty());
  for (const CueProduct& product : products) EXPECT_FALSE(product.of_a.hinge || product.of_b.hinge);
}

// Some of the thousands of candidates fit a few hundred poses by chance.
TEST(CueProducts, AreNoneOfFewPoses) { EXPECT_TRUE(ChooseFor(FacePoses(900, 0.01, 0.02, 1)).empty()); }

TEST(CueProducts, AreNoneWhereThereAreFarMoreScalarsThanPoses) {
  const PoseMatrix poses = FacePoses(1200, 0.01, 0.02, 1);
  EXPECT_FALSE(ChooseFor(poses, true, 100).empty());
  EXPECT_TRUE(ChooseFor(poses, true, 2500).empty());
}

TEST(CueProducts, AreNoneWhereScalarsSayAll) { EXPECT_TRUE(ChooseFor(FacePoses(1500, 0, 0, 1)).empty()); }

// Products take the place of points: with them scalars alone tell the shape of new poses.
TEST(CueProducts, LetScalarsTellTheShape) {
  PoseMatrix poses = FacePoses(1500, 0.01, 0.02, 1), fresh = FacePoses(300, 0.01, 0.02, 2);
  const std::vector<CueProduct> products = ChooseFor(poses);
  StoreAll(products, &poses);
  StoreAll(products, &fresh);
  const Eigen::VectorXd mean = poses.Mean();
  poses.Subtract(mean);
  fresh.Subtract(mean);
  const Pca pca = *ComputePca(poses, mean, {.max_modes = 20});
  const auto error = [&](Index scalars) {
    std::vector<CueRef> cues;
    for (Index s = 0; s < scalars; ++s) cues.push_back({CueKind::kScalar, s});
    const CueSet set = MakeCueSet(pca, cues, CueNoise(1.0));
    return RmsError(EstimateErrors(pca, set, MapEstimator(pca, set), fresh), kFacePoints);
  };
  const double without = error(kFaceScalars),
               with = error(kFaceScalars + static_cast<Index>(products.size()));
  EXPECT_GT(without, 5 * kFaceTolerance);
  EXPECT_LT(with, 0.2 * kFaceTolerance);
}

TEST(CueProducts, StayWithinTheirTrainedRange) {
  CueProduct product;
  product.a = 0, product.b = 1;
  product.of_a = {0.5, 2, false}, product.of_b = {0.25, 1, true};
  product.lo = -1, product.hi = 1;
  const auto of = [&](float a, float b) { return ValueOf(product, std::vector<float>{a, b}); };
  EXPECT_DOUBLE_EQ(of(0.75f, 0.75f), 0.25);
  EXPECT_DOUBLE_EQ(of(0.75f, 0.0f), 0) << "below the hinge";
  EXPECT_DOUBLE_EQ(of(9, 9), 1);
  EXPECT_DOUBLE_EQ(of(-9, 9), -1);
  EXPECT_TRUE(std::isnan(product.of_b.Of(std::nan(""))));
}

}  // namespace
}  // namespace kpsa::engine
