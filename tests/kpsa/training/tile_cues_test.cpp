// Cues of single tiles: a limb of two joints that swings far and bends a little.
#include "kpsa/training/tile_cues.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <random>

#include "kpsa/training/cue_values.h"
#include "kpsa/training/pose_judge.h"
#include "kpsa/training/tile_subspace.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kLimbPoints = 2 * kTilePoints;
constexpr Index kUpperEntry = 1, kLowerEntry = 13;  // scalars: a weight, then both matrices
constexpr double kLimbTolerance = 2e-3;

PoseLayout LimbLayout() {
  PoseLayout layout;
  layout.points = kLimbPoints;
  layout.scalars = 25;
  layout.relative_begin = 1;
  return layout;
}

// A limb along x, bent at 0.5; the flesh about the bend bulges with the square of the angle, and a weight
// makes the upper half thicker. scale: of the joints, as of an armature in other units.
PoseMatrix LimbPoses(std::size_t count, unsigned seed, double scale = 1) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  PoseMatrix poses(LimbLayout());
  for (std::size_t t = 0; t < count; ++t) {
    const double bend = 0.5 + 0.5 * unit(random), weight = 0.5 + 0.5 * unit(random);
    Affine upper, lower, local;
    const Eigen::Vector3d axis = Eigen::Vector3d(unit(random), unit(random), unit(random)).normalized();
    upper << Eigen::AngleAxisd(1.5 * unit(random), axis).toRotationMatrix(), Eigen::Vector3d(0.1, 0.2, 0.3);
    local << Eigen::AngleAxisd(bend, Eigen::Vector3d::UnitZ()).toRotationMatrix(), Eigen::Vector3d(0.5, 0, 0);
    lower = Product(upper, local);
    const std::span<float> row = poses.AddPose();
    for (std::size_t i = 0; i < kLimbPoints; ++i) {
      const double along = (static_cast<double>(i) + 0.5) / kLimbPoints, turn = 2.4 * static_cast<double>(i);
      const double share = std::clamp(5 * (along - 0.4), 0.0, 1.0);  // of the lower joint
      const double thick = 0.05 * (1 + 0.3 * weight * (1 - share) + 0.2 * bend * bend * share * (1 - share));
      const Eigen::Vector3d at(along, thick * std::cos(turn), thick * std::sin(turn));
      const Eigen::Vector3d moved =
          (1 - share) * (upper.leftCols<3>() * at + upper.col(3)) +
          share * (lower.leftCols<3>() * (at - Eigen::Vector3d(0.5, 0, 0)) + lower.col(3));
      for (std::size_t c = 0; c < 3; ++c)
        row[3 * i + c] = static_cast<float>(moved[static_cast<Eigen::Index>(c)]);
    }
    const std::span<float> scalars = row.subspan(poses.layout().scalar_begin());
    scalars[0] = static_cast<float>(weight);
    for (std::size_t e = 0; e < 12; ++e) {
      scalars[kUpperEntry + e] = static_cast<float>((e < 9 ? scale : 1) * upper.data()[e]);
      scalars[kLowerEntry + e] = static_cast<float>((e < 9 ? scale : 1) * lower.data()[e]);
    }
  }
  return poses;
}

struct Limb {
  explicit Limb(bool joints, double scale = 1) : poses(LimbPoses(1200, 1, scale)) {
    mean = poses.Mean();
    poses.Subtract(mean);
    std::vector<TileCandidates> tiles(2);
    for (std::size_t t = 0; t < 2; ++t) {
      tiles[t].first_column = 3 * kTilePoints * t, tiles[t].height = 3 * kTilePoints;
      tiles[t].joints = {kUpperEntry, kLowerEntry};
      if (!joints) continue;
      for (Index i = 0; i < kTilePoints; i += 8)
        tiles[t].points.push_back({CueKind::kOutput, static_cast<Index>(kTilePoints * t) + i});
      tiles[t].own_points = tiles[t].points.size();
    }
    TileCueOptions options;
    options.tolerance = kLimbTolerance, options.mean = &mean, options.turn_reach = 0.03;
    options.values = {{CueKind::kScalar, 0}};
    choice = ChooseTiles(mean, poses, tiles, options);
    chosen = choice.tiles;
    made = MakeTileSubspace(mean, poses, 0, choice, {{"limb", kLimbPoints}},
                            {.rms_budget = 0.03 * kLimbTolerance, .max_budget = 0.2 * kLimbTolerance});
  }
  double LargestError(const PoseMatrix& fresh) const {
    double largest = 0;
    for (const JudgedPose& pose :
         PoseJudge(TrainingRig(), made.subspace, fresh.layout(), made.cues, false).Judge(fresh))
      largest = std::max(largest, pose.error);
    return largest;
  }
  PoseMatrix poses;
  Eigen::VectorXd mean;
  TileChoice choice;
  TileCues chosen;
  TileSubspace made;
};

TEST(TileCues, FitsServeTilesThatAreStoredInAnotherWay) {
  const Limb limb(true);
  const TileOptions coarse{.rms_budget = 0.1 * kLimbTolerance, .max_budget = 0.5 * kLimbTolerance},
      fine{.rms_budget = 0.03 * kLimbTolerance, .max_budget = 0.2 * kLimbTolerance};
  std::vector<TileModel> fits;
  const auto made = [&](const TileOptions& options) {
    return MakeTileSubspace(limb.mean, limb.poses, 0, limb.choice, {{"limb", kLimbPoints}}, options, &fits);
  };
  const TileSubspace first = made(coarse), second = made(fine);
  ASSERT_EQ(fits.size(), 2u);
  EXPECT_EQ(fits[0].target.size(), 0);
  const TileData &again = second.subspace.tiles[0].data(), &anew = limb.made.subspace.tiles[0].data();
  EXPECT_LT(first.subspace.tiles[0].bytes(), second.subspace.tiles[0].bytes());
  EXPECT_EQ(again.columns, anew.columns);
  EXPECT_EQ(again.ranks, anew.ranks);
  EXPECT_TRUE(std::ranges::equal(again.u.span(), anew.u.span()));
  EXPECT_TRUE(std::ranges::equal(again.mean.span(), anew.mean.span()));
}

// What a last step reads is stored more finely, tile by tile.
TEST(TileCues, BeforeALastStepErrorsCountMore) {
  const Limb limb(true);
  const TileOptions coarse{.rms_budget = 0.1 * kLimbTolerance, .max_budget = 0.5 * kLimbTolerance},
      fine{.rms_budget = 0.04 * kLimbTolerance, .max_budget = 0.2 * kLimbTolerance};
  const auto stored = [&](const TileOptions& options, std::size_t inner, std::vector<Index> tiles) {
    SubspaceOutput output{"limb@mush", kLimbPoints, "mush", inner};
    output.stepped.points = PointsOfTiles(tiles, kLimbPoints);
    const TileSubspace made = MakeTileSubspace(limb.mean, limb.poses, 0, limb.choice, {output}, options);
    const TileData& data = made.subspace.tiles[0].data();
    return std::pair(data.ranks[0] + 256 * data.counts[0], data.ranks[1] + 256 * data.counts[1]);
  };
  const auto as_coarse = stored(coarse, 0, {}), as_fine = stored(fine, 0, {});
  ASSERT_NE(as_coarse.first, as_fine.first);
  ASSERT_NE(as_coarse.second, as_fine.second);
  EXPECT_EQ(stored(coarse, kLimbPoints, {}), as_fine);
  EXPECT_EQ(stored(coarse, kLimbPoints, {1}), std::pair(as_coarse.first, as_fine.second));
  EXPECT_EQ(stored(coarse, kLimbPoints, {0}), std::pair(as_fine.first, as_coarse.second));
  EXPECT_EQ(BudgetOfTile({"m@mush", 2 * kTilePoints + 5, "mush", 0}, 2), 1);
  SubspaceOutput some{"m@mush", 2 * kTilePoints + 5, "mush", 3 * kTilePoints};
  some.stepped.points = PointsOfTiles(std::vector<Index>{0}, some.points);
  EXPECT_LT(BudgetOfTile(some, 0), 1);
  EXPECT_EQ(BudgetOfTile(some, 1), 1);
  EXPECT_EQ(BudgetOfTile(some, 2), BudgetOfTile(some, 0)) << "it holds inner points, too";
}

TEST(TileCues, ALimbIsToldInTheSpaceOfItsJoint) {
  const Limb limb(true);
  for (const Index joint : limb.chosen.joint)
    EXPECT_TRUE(joint == kUpperEntry || joint == kLowerEntry) << joint;
  const PoseMatrix fresh = LimbPoses(200, 2);
  EXPECT_LT(limb.LargestError(fresh), kLimbTolerance);
  EXPECT_LT(limb.made.subspace.rows(), 60u);  // of 27 candidates a joint, and points
  // What no tile reads is not measured
  const TileData& data = limb.made.subspace.tiles[0].data();
  std::vector<char> read(limb.made.subspace.rows(), 0);
  for (const auto* columns : {&data.columns, &data.joint_rows}) {
    for (const std::uint32_t column : *columns) read[column] = 1;
  }
  for (std::size_t k = 0; k < limb.made.cues.cues.size(); ++k) {
    const Index begin = limb.made.cues.offsets[k], end = limb.made.cues.offsets[k + 1];
    EXPECT_TRUE(std::any_of(read.begin() + begin, read.begin() + end, [](char r) { return r != 0; })) << k;
  }
}

TEST(TileCues, JointsOfAnyScaleTellAsMuch) {
  const double error = Limb(true).LargestError(LimbPoses(200, 2));
  for (const double scale : {1.0 / 128, 0.01, 100.0, 128.0}) {
    const Limb limb(true, scale);
    for (const Index joint : limb.chosen.joint)
      EXPECT_TRUE(joint == kUpperEntry || joint == kLowerEntry) << joint;
    const bool of_two = std::exp2(std::round(std::log2(scale))) == scale;
    EXPECT_LT(limb.LargestError(LimbPoses(200, 2, scale)), of_two ? 1.01 * error : 0.3 * kLimbTolerance)
        << scale;
  }
  for (const auto& [scale, expected] :
       {std::pair{1.0, 1.0}, {0.3, 1.0}, {3.0, 1.0}, {100.0, 128.0}, {0.01, 1.0 / 128}}) {
    PoseMatrix poses = LimbPoses(50, 3, scale);
    EXPECT_EQ(JointScale(poses, nullptr, kUpperEntry), expected);
    const Eigen::VectorXd mean = poses.Mean();
    poses.Subtract(mean);
    EXPECT_EQ(JointScale(poses, &mean, kLowerEntry), expected) << "however far it turns";
  }
}

// Before any tile is stored: what is beyond even then is the least that they miss.
TEST(TileCues, SayWhatTheyWouldMiss) {
  const Limb limb(true);
  double farthest = 0;
  for (const JudgedPose& pose :
       PoseJudge(TrainingRig(), limb.made.subspace, LimbLayout(), limb.made.cues, false).Judge([&] {
         PoseMatrix same(LimbLayout());
         for (std::size_t t = 0; t < limb.poses.poses(); ++t) {
           const std::span<float> row = same.AddPose();
           for (std::size_t i = 0; i < row.size(); ++i)
             row[i] = std::as_const(limb.poses).row(t)[i] +
                      static_cast<float>(limb.mean[static_cast<Eigen::Index>(i)]);
         }
         return same;
       }()))
    farthest = std::max(farthest, pose.error);
  const Eigen::MatrixXf errors = TileErrors(limb.poses, limb.choice);
  EXPECT_EQ(ShareBeyond(errors, farthest), 0) << "storing adds to the errors";
  EXPECT_EQ(ShareBeyond(errors, 0), 1);
  std::vector<TileModel> fits;
  MakeTileSubspace(limb.mean, limb.poses, 0, limb.choice, {{"limb", kLimbPoints}},
                   {.rms_budget = kLimbTolerance, .max_budget = kLimbTolerance}, &fits);
  EXPECT_EQ(TileErrors(limb.poses, limb.choice, fits), errors) << "they are fitted to the same poses";
  // Without the entries of a joint hardly a pose is told
  TileChoice blind = limb.choice;
  for (std::vector<std::uint32_t>& cues : blind.tiles.of_tile) cues.clear();
  const Eigen::MatrixXf of_blind = TileErrors(limb.poses, blind);
  EXPECT_GT(ShareBeyond(of_blind, kLimbTolerance), 0.5);
  // Folded poses count for none, but say which points are off
  blind.options.ranges = {0, 0, 1000};
  PointsOff off;
  const Eigen::MatrixXf but_folded = TileErrors(limb.poses, blind, {}, &off);
  EXPECT_EQ(but_folded.topRows(1000).cwiseAbs().maxCoeff(), 0);
  EXPECT_EQ(but_folded.bottomRows(200), of_blind.bottomRows(200));
  blind.options.ranges = {};
  PointsOff of_drawn;
  TileErrors(limb.poses, blind, {}, &of_drawn);
  EXPECT_FALSE(off.plain.Turned().empty());
  EXPECT_TRUE(of_drawn.plain.Turned().empty());
  EXPECT_EQ(off.plain.Worst(0), of_drawn.plain.Worst(0)) << "beyond half the tolerance in any pose";
}

TEST(TileCues, SayInHowManyPosesTilesAreBeyond) {
  Eigen::MatrixXf errors = Eigen::MatrixXf::Constant(100, 6, 0.1f);
  errors.col(4).head(40).setConstant(2);
  errors.col(1).segment(38, 10).setConstant(3);
  errors(99, 0) = 4;
  EXPECT_EQ(ShareBeyond(errors, 1), 0.49);
  const std::size_t but[] = {4};
  EXPECT_EQ(ShareBeyond(errors, 1, but), 0.11);
}

// The run time's way, against y, the stored joint and the points in its space, one by one.
TEST(TileCues, AreGivenUpWhereSomeOfManyLeaveMuch) {
  Eigen::MatrixXf errors = Eigen::MatrixXf::Constant(100, 6, 0.1f);
  errors.col(4).head(3).setConstant(2), errors.col(1).tail(2).setConstant(2);
  EXPECT_EQ(ExpectedBeyond(errors, 1, 8), 0.4);
  EXPECT_EQ(ExpectedBeyond(errors, 2, 8), 0);
  EXPECT_EQ(ExpectedBeyond(errors, 1, 8, std::vector<std::size_t>{4}), 0.16);

  const Limb limb(true);
  const auto promises = [&](bool told, double most_of_half, double most_of_whole, std::size_t untold = 0) {
    TileCandidates tile = limb.choice.candidates[0];
    TileCueOptions options = limb.choice.options;
    if (!told) options.values.clear();
    TileCandidates blind = tile;
    blind.joints.clear(), blind.points.clear(), blind.own_points = 0;
    std::vector<TileCandidates> tiles(72, told ? tile : blind);
    for (std::size_t t = 0; t < untold; ++t) tiles[8 * t] = blind;
    TriedTiles trial;
    TileChoice choice;
    return ChoosePromisingTiles(limb.mean, limb.poses, tiles, options,
                                {.most_of_half = most_of_half, .most_of_whole = most_of_whole}, &trial,
                                &choice)
        .promising;
  };
  EXPECT_TRUE(promises(true, 0.03, 0));
  EXPECT_FALSE(promises(false, 0.03, 0));
  EXPECT_FALSE(promises(false, 1, 1)) << "whatever may be left by some of them";
  EXPECT_TRUE(promises(true, 0.03, 0, 1)) << "one of nine that are tried";
  EXPECT_FALSE(promises(true, 0.03, 0, 2));
}

TEST(TileCues, PointsGoThroughTheMatrixOfTheJoint) {
  const Limb limb(true);
  const PoseMatrix fresh = LimbPoses(5, 3);
  const Subspace& s = limb.made.subspace;
  TileData in_joint = s.tiles[0].data();
  in_joint.joints.clear(), in_joint.joint_rows.clear();
  in_joint.joint_mean.clear(), in_joint.joint_deviation.clear();
  const TileMap local = *TileMap::Make(in_joint, "local");
  for (std::size_t t = 0; t < fresh.poses(); ++t) {
    std::vector<double> raw(s.rows());
    CueReader reader(fresh.layout(), fresh.row(t), nullptr);
    for (std::size_t k = 0; k < limb.made.cues.cues.size(); ++k)
      reader.Read(limb.made.cues.cues[k], raw.data() + limb.made.cues.offsets[k]);
    SubspaceScratch scratch(s);
    Measure(s, raw, &scratch);
    Matrix4 space;
    space(0, 1) = 0.5, space(1, 3) = 2;
    PointBuffer whole(kLimbPoints), bare(kLimbPoints), from_inputs(kLimbPoints);
    s.tiles[0].Reconstruct(scratch.inputs(), whole.view(), &space);
    local.Reconstruct(scratch.inputs(), bare.view());
    const ConstPointsView got = std::as_const(whole).view(), b = std::as_const(bare).view();
    for (std::size_t i = 0; i < kLimbPoints; i += 7) {
      const Index joint = limb.chosen.joint[i / kTilePoints];
      Affine matrix = RelativeMatrix(fresh.layout(), fresh.row(t), nullptr, joint);
      Eigen::Vector3d p = matrix.leftCols<3>() * Eigen::Vector3d(b.x[i], b.y[i], b.z[i]) + matrix.col(3);
      p = {p[0] + 0.5 * p[1], p[1] + 2, p[2]};
      EXPECT_NEAR(got.x[i], p[0], 2e-6);
      EXPECT_NEAR(got.y[i], p[1], 2e-6);
      EXPECT_NEAR(got.z[i], p[2], 2e-6);
    }
    // From the inputs that a doubt has left: the same bits
    AlignedFloats inputs(s.tiles[0].input_size());
    s.tiles[0].ComputeInputs(scratch.inputs(), inputs.span());
    const float* from[1] = {inputs.data()};
    const PointsView views[1] = {from_inputs.view()};
    s.tiles[0].ReconstructFrom(from, views, {}, {&space, 1});
    EXPECT_EQ(from_inputs.Interleaved(), whole.Interleaved());
  }
}

TEST(TileCues, JointsTravelWithTheFileAndAreChecked) {
  Limb limb(false);
  Subspace& s = limb.made.subspace;
  ASSERT_FALSE(s.tiles[0].data().joints.empty());
  s.score = {0, 1};
  if (s.doubt_inputs() == 0) s.score = {1, 0};
  for (const CueRef& cue : limb.made.cues.cues) {
    CueDescription description;
    description.kind = CueDescription::Kind::kScalar;
    description.plug =
        cue.index == 0 ? "limb.weight" : fmt::format("lower.worldMatrix/{}", (cue.index - 1) % 12);
    description.joint = cue.joint == kNoIndex ? "" : "upper.worldMatrix";
    s.cues.push_back(description);
  }
  ASSERT_GT(s.doubt_inputs(), 0u);
  const std::string path = (std::filesystem::temp_directory_path() / "kpsa_tile_cues_test.kpsa").string();
  ASSERT_TRUE(WriteSubspace(s, path).ok()) << WriteSubspace(s, path).ToString();
  const Result<Subspace> read = ReadSubspace(path);
  std::filesystem::remove(path);
  ASSERT_TRUE(read.ok()) << read.status().ToString();
  EXPECT_EQ(read->cues, s.cues);
  EXPECT_EQ(read->tiles[0].data().joints, s.tiles[0].data().joints);
  EXPECT_EQ(read->tiles[0].data().joint_rows, s.tiles[0].data().joint_rows);
  EXPECT_EQ(read->tiles[0].data().joint_mean, s.tiles[0].data().joint_mean);
  EXPECT_EQ(read->soft_cache.factor.size(), 0u);

  const auto refused = [&](const std::function<void(TileData*)>& damage) {
    TileData data = s.tiles[0].data();
    damage(&data);
    return !TileMap::Make(std::move(data), "damaged").ok();
  };
  EXPECT_FALSE(refused([](TileData*) {}));
  EXPECT_TRUE(refused([](TileData* d) { d->joints[0] = 99; }));
  EXPECT_TRUE(refused([](TileData* d) { d->joints.pop_back(); }));
  EXPECT_TRUE(refused([](TileData* d) { d->joint_rows[3] = 1u << 20; }));
  EXPECT_TRUE(refused([](TileData* d) { d->joint_rows.pop_back(); }));
  EXPECT_TRUE(refused([](TileData* d) { d->joint_mean[0] = std::nan(""); }));
  EXPECT_TRUE(refused([](TileData* d) { d->joint_deviation.clear(); }));
  Subspace many = s;
  while (many.cues.size() < s.cues.size() + 1) many.cues.push_back(s.cues.back());
  EXPECT_FALSE(ValidateSubspace(many).ok());
}

TEST(TileCues, SpacesOfJointsAreLimited) {
  Limb limb(false);
  Subspace s = std::move(limb.made.subspace);
  s.cues.resize(kMaxCueJoints + 1);
  for (std::size_t k = 0; k < s.cues.size(); ++k) s.cues[k].joint = fmt::format("j{}.worldMatrix", k);
  EXPECT_NE(ValidateSubspace(s).ToString().find("at most 64"), std::string::npos);
}

}  // namespace
}  // namespace kpsa::engine
