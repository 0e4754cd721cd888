// Points whose frames a deltaMush turns over are mended: what its last step needs is reconstructed, and the step gives
// them.
#include <algorithm>
#include <cmath>
#include <memory>

#include "tests/cli/hello_folder.h"
#include "tests/cli/rig_run.h"

namespace kpsa::engine {
namespace {

constexpr double kFineTolerance = 1e-5;  // that a few points of the elbow go beyond

TrainOptions FineTraining(bool mends) {
  TrainOptions options = QuickTraining();
  options.tolerance = kFineTolerance;
  options.rows = 60, options.min_points = 4, options.max_modes = 8;
  options.may_have_cues_by_tile = false;
  options.inner = TrainOptions::Inner::kNever;
  options.without.mends = !mends;
  return options;
}

class MendedPoints : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new HelloFolder;
    folder_->Edit("stack: [skin, cage, mush]", "stack: [skin, mush]");
    trained_ = TrainRig(folder_->rig(), FineTraining(true));
    ASSERT_NE(trained_, nullptr);
    ASSERT_FALSE(trained_->mends.empty());
  }
  static void TearDownTestSuite() {
    trained_.reset();
    delete folder_;
  }
  static RigRunOptions AnyError(std::shared_ptr<const Subspace> subspace) {
    return {.subspace = std::move(subspace), .accelerate = {.tolerance = kInfinity}};
  }
  static std::vector<Index> Mended() {
    std::vector<Index> points;
    for (const TileMend& mend : trained_->mends)
      points.insert(points.end(), mend.points.begin(), mend.points.end());
    return points;
  }
  static double Distance(const std::vector<float>& a, const std::vector<float>& b, Index point) {
    double sum = 0;
    for (std::size_t i = point; i < a.size(); i += a.size() / 3)
      sum += std::pow(static_cast<double>(a[i] - b[i]), 2);
    return std::sqrt(sum);
  }
  static inline const HelloFolder* folder_ = nullptr;
  static inline std::shared_ptr<const Subspace> trained_;
};

TEST_F(MendedPoints, AreNearerAndOthersAreAsTheyWere) {
  const auto without = TrainRig(folder_->rig(), FineTraining(false));
  ASSERT_NE(without, nullptr);
  EXPECT_TRUE(without->mends.empty());
  RigRun full(folder_->rig()), run(folder_->rig(), AnyError(trained_)),
      plain(folder_->rig(), AnyError(without));
  ASSERT_TRUE(run.ok()) << run.error;
  const std::vector<Index> mended = Mended();
  std::vector<double> worst(mended.size(), 0), before(mended.size(), 0);
  for (const auto& pose : SmoothPoses(run.rig, 60, 0.95)) {
    full.Pose(pose), run.Pose(pose), plain.Pose(pose);
    const std::vector<float> exact = full.Evaluate().points, with = run.Evaluate().points,
                             as_before = plain.Evaluate().points;
    for (std::size_t k = 0; k < mended.size(); ++k) {
      worst[k] = std::max(worst[k], Distance(with, exact, mended[k]));
      before[k] = std::max(before[k], Distance(as_before, exact, mended[k]));
    }
    for (Index p = 0; p < exact.size() / 3; ++p) {
      if (std::ranges::find(mended, p) != mended.end()) continue;
      EXPECT_EQ(Distance(with, as_before, p), 0) << p;
    }
  }
  double sum = 0, sum_before = 0;
  for (std::size_t k = 0; k < mended.size(); ++k) sum += worst[k], sum_before += before[k];
  EXPECT_LT(sum, 0.7 * sum_before);
}

TEST_F(MendedPoints, HaveTheirBitsInAnyCompany) {
  RigRun run(folder_->rig(), AnyError(trained_));
  ASSERT_TRUE(run.ok()) << run.error;
  const std::vector<Index> mended = Mended();
  ExpectBitsOfAll(&run, {{mended[0]}, {mended.back()}, mended});
}

// What the step has besides points may vary: then points are as their tiles have them, and what is set misses.
TEST_F(MendedPoints, NotWhereTheStepVaries) {
  const std::vector<std::string> varying = {"mush.envelope"};
  RigRunOptions any = AnyError(trained_);
  any.varying = varying;
  RigRun full(folder_->rig(), {.varying = varying}), run(folder_->rig(), any),
      careful(folder_->rig(), {.subspace = trained_, .varying = varying});
  ASSERT_TRUE(run.ok()) << run.error;
  ASSERT_TRUE(careful.ok()) << careful.error;
  for (const auto& pose : SmoothPoses(run.rig, 5, 0.8)) {
    run.Pose(pose);
    EXPECT_TRUE(run.Evaluate().hit);
    for (RigRun* of : {&full, &careful}) of->Pose(pose), of->Set("mush.envelope", 0.5);
    EXPECT_TRUE(SameBytes(careful.Evaluate().points, full.Evaluate().points));
  }
}

// Where the step's floats are not as exact as the tolerance, no point is mended, and all is trained as without.
TEST_F(MendedPoints, NotWhereTheToleranceIsFinerThanTheStep) {
  TrainOptions options = FineTraining(true);
  options.tolerance = 1e-7;
  const auto trained = TrainRig(folder_->rig(), options);
  ASSERT_NE(trained, nullptr);
  EXPECT_TRUE(trained->mends.empty());
}

TEST_F(MendedPoints, AreInTheFile) {
  const std::string path = *folder_ / "mends.kpsa";
  ASSERT_TRUE(WriteSubspace(*trained_, path).ok());
  EXPECT_NE(folder_->Read(path).find("\"version\":\"11\""), std::string::npos);
  const Result<Subspace> read = ReadSubspace(path);
  ASSERT_TRUE(read.ok()) << read.status().ToString();
  EXPECT_EQ(read->mends, trained_->mends);
}

TEST_F(MendedPoints, ThatMakeNoSenseAreRefused) {
  const auto refused = [](auto edit) {
    Subspace s = *trained_;
    edit(&s.mends[0]);
    return !ValidateSubspace(s).ok();
  };
  EXPECT_FALSE(refused([](TileMend*) {}));
  EXPECT_TRUE(refused([](TileMend* mend) { mend->output = 1; }));
  EXPECT_TRUE(refused([](TileMend* mend) { mend->tile = 1000; }));
  EXPECT_TRUE(refused([](TileMend* mend) { mend->points.clear(); }));
  EXPECT_TRUE(refused([](TileMend* mend) { mend->points.push_back(mend->points.back()); }));
  EXPECT_TRUE(refused([](TileMend* mend) { mend->points.push_back(1u << 20); }));
  EXPECT_TRUE(refused([](TileMend* mend) { mend->inner.push_back(0); }));
  EXPECT_TRUE(refused([](TileMend* mend) { mend->mean.pop_back(); }));
  EXPECT_TRUE(refused([](TileMend* mend) { mend->map.push_back(0); }));
  EXPECT_TRUE(refused([](TileMend* mend) { mend->map[0] = std::nanf(""); }));
  Subspace twice = *trained_;
  twice.mends.push_back(twice.mends[0]);
  EXPECT_FALSE(ValidateSubspace(twice).ok());
  // A list that no last step asks for
  auto other = std::make_shared<Subspace>(*trained_);
  other->mends[0].inner.back() += 1;
  EXPECT_NE(RigRun(folder_->rig(), {.subspace = other}).error.find("last step"), std::string::npos);
}

}  // namespace
}  // namespace kpsa::engine
