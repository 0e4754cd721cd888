// What bench_ablation compares: pivots, poses as the baselines read them, and training without its parts.
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <algorithm>
#include <cstdlib>
#include <set>
#include <span>

#include "bench/ablation_parts.h"
#include "bench/ablation_points.h"
#include "bench/ablation_q_deim.h"
#include "host/rig_training.h"
#include "files/npz.h"
#include "kpsa/training/random.h"
#include "nodes/standard_nodes.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine::ablation {
namespace {

const std::string kHelloRig = KPSA_SCENES_DIR "/hello/hello.yaml";
constexpr std::size_t kFewSamples = 100;

Eigen::MatrixXd RandomModes(Eigen::Index rows, Eigen::Index modes) {
  Random random(1);
  return Eigen::MatrixXd::NullaryExpr(rows, modes, [&] { return random.Unit() - 0.5; });
}

TEST(QDeim, OfSingleRowsIsThePivotedFactorisation) {
  const Eigen::MatrixXd modes = RandomModes(40, 12);
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(modes.transpose());
  const std::vector<Index> points = QDeimPoints(modes, 1, 12);
  ASSERT_EQ(points.size(), 12u);
  for (std::size_t k = 0; k < points.size(); ++k) {
    EXPECT_EQ(static_cast<Eigen::Index>(points[k]),
              qr.colsPermutation().indices()[static_cast<Eigen::Index>(k)]);
  }
}

TEST(QDeim, TakesPointsThatTellWhatOthersDoNot) {
  // Points 1 and 3 move alike, 1 a little less; 2 moves otherwise, and less than both; 0 stands still
  Eigen::MatrixXd modes = Eigen::MatrixXd::Zero(12, 6);
  modes.block<3, 3>(9, 0) = 4 * Eigen::Matrix3d::Identity();
  modes.block<3, 3>(3, 0) = 3 * Eigen::Matrix3d::Identity();
  modes.block<3, 3>(6, 3) = Eigen::Matrix3d::Identity();
  EXPECT_EQ(QDeimPoints(modes, 3, 2), (std::vector<Index>{3, 2}));
  // Then all is spanned, and the others follow by themselves; there are no more than four
  EXPECT_EQ(QDeimPoints(modes, 3, 9), (std::vector<Index>{3, 2, 1, 0}));
}

TEST(QDeim, GoesOnWhereAllIsSpanned) {
  const std::vector<Index> points = QDeimPoints(RandomModes(90, 6), 3, 20);
  EXPECT_EQ(std::set<Index>(points.begin(), points.end()).size(), 20u);
}

TEST(Ablation, ComparesCuesOfTheSmallestRig) {
  AblationPoses poses;
  const Status loaded = poses.Load(kHelloRig, kFewSamples);
  ASSERT_TRUE(loaded.ok()) << loaded.ToString();
  std::vector<PointsRow> rows;
  const std::size_t counts[] = {2, 6};
  ComparePoints(&poses, counts, [&](const PointsRow& row) { rows.push_back(row); });
  std::set<std::string> names;
  const double motion = 100 * poses.motion_rms / poses.diagonal;
  for (const PointsRow& row : rows) {
    EXPECT_TRUE(names.insert(row.cues + row.estimator).second) << row.cues;
    ASSERT_EQ(row.scores.size(), 2u);
    for (const PointsScore& score : row.scores) {
      EXPECT_GT(score.rms, 0) << row.cues;
      EXPECT_LT(score.rms, score.max) << row.cues;
      if (row.estimator == std::string("MAP")) {
        EXPECT_LT(score.rms, motion) << row.cues;
      }
    }
  }
  EXPECT_EQ(rows.size(), 17u);
}

TEST(Ablation, BaselinesReadTheSamePoses) {
  const TemporaryFolder folder;
  AblationPoses poses;
  ASSERT_TRUE(poses.Load(kHelloRig, kFewSamples).ok());
  const std::string path = folder / "poses.npz";
  const Status dumped = poses.Dump(path);
  ASSERT_TRUE(dumped.ok()) << dumped.ToString();
  const Result<Npz> file = ReadNpz(path);
  ASSERT_TRUE(file.ok()) << file.status().ToString();
  const PoseLayout& layout = poses.training->layout();
  const std::size_t inputs = layout.scalars - layout.products, local = layout.products_begin();
  EXPECT_EQ(file->Find("local_inputs")->Doubles(), std::vector<double>{static_cast<double>(local)});
  EXPECT_EQ(file->Find("diagonal")->Doubles(), std::vector<double>{poses.diagonal});
  EXPECT_EQ(file->Find("train_points")->shape,
            (std::vector<std::uint64_t>{poses.training->poses(), layout.outputs()}));
  const std::vector<float> points = file->Find("test_points")->Floats(),
                           entries = file->Find("test_inputs")->Floats();
  ASSERT_EQ(points.size(), poses.test->poses() * layout.outputs());
  ASSERT_EQ(entries.size(), poses.test->poses() * inputs);
  const std::size_t last = poses.test->poses() - 1;
  const std::span<const float> row = std::as_const(*poses.test).row(last);
  EXPECT_EQ(points[last * layout.outputs() + 5], row[5]);
  EXPECT_EQ(entries[last * inputs], row[layout.scalar_begin()]);
  EXPECT_EQ(entries.back(), row.back());

  if (std::system("python3 --version > /dev/null 2>&1") != 0) GTEST_SKIP() << "no python3";
  const std::string line =
      "python3 " KPSA_SOURCE_DIR "/bench/baselines.py --list " + path + " > " + (folder / "list");
  ASSERT_EQ(std::system(line.c_str()), 0);
  const std::string list = TemporaryFolder::Read(folder / "list");
  EXPECT_NE(list.find("test_inputs <f4 " + std::to_string(poses.test->poses()) + " " +
                      std::to_string(inputs) + "\n"),
            std::string::npos)
      << list;
  EXPECT_NE(list.find("diagonal <f8\n"), std::string::npos) << list;
}

TEST(Ablation, TimesWhatIsTrained) {
  const TemporaryFolder folder;
  PartsOptions options;
  options.folder = folder.path();
  options.samples = kFewSamples;
  options.calibration_poses = 60;
  options.key_points = 10;
  options.runs = 1;
  const std::vector<Part> parts = Parts();
  const Result<std::vector<PartsRow>> rows = CompareParts(kHelloRig, std::span(parts).first(2), options);
  ASSERT_TRUE(rows.ok()) << rows.status().ToString();
  ASSERT_EQ(rows->size(), 2u);
  for (const PartsRow& row : *rows) {
    EXPECT_GT(row.full_ms, 0) << row.what;
    EXPECT_GT(row.ms, 0) << row.what;
    EXPECT_GT(row.rms, 0) << row.what;  // of reconstructed frames, whatever hits
    EXPECT_LT(row.rms, row.max) << row.what;
  }
  EXPECT_EQ((*rows)[1].what, "paper mode");
  EXPECT_EQ((*rows)[1].cue_points, 10u);
  EXPECT_EQ((*rows)[1].cue_scalars + (*rows)[1].cue_products, 0u);
}

TEST(Ablation, TrainsWithoutEachPart) {
  NodeRegistry registry;
  AddStandardNodes(registry);
  AddKpsaNode(registry);
  RigOptions rest;
  rest.rest = true;
  Result<Rig> rig = LoadRig(registry, kHelloRig, rest);
  ASSERT_TRUE(rig.ok());
  const auto train = [&](bool without) {
    TrainOptions options;
    options.samples = 1200;
    options.calibration_poses = 60;
    options.tolerance = 5e-4;
    options.inner = TrainOptions::Inner::kNever;  // which need none of it on so small a rig
    options.without = {without, without, without, without, without, without};
    options.may_have_cues_by_tile = !without;
    Result<Subspace> trained = Train(MakeTrainingRig(&*rig, rig->accelerate[0]), {}, options);
    EXPECT_TRUE(trained.ok()) << trained.status().ToString();
    return trained.ok() ? std::move(*trained) : Subspace();
  };
  const Subspace all = train(false), none = train(true);
  const auto count = [](const Subspace& subspace, auto&& is) {
    return std::count_if(subspace.cues.begin(), subspace.cues.end(), is);
  };
  const auto product = [](const CueDescription& cue) { return cue.kind == CueDescription::Kind::kProduct; };
  const auto matrix = [](const CueDescription& cue) {
    return cue.plug.find("worldMatrix") != std::string::npos;
  };
  EXPECT_GT(count(all, product), 0);
  EXPECT_GT(count(all, matrix), 0);
  EXPECT_GT(all.doubt_inputs(), 0u);
  EXPECT_EQ(count(none, product), 0);
  EXPECT_EQ(count(none, matrix), 0);
  EXPECT_EQ(none.doubt_inputs(), 0u);
  EXPECT_EQ(none.patches.tiles, 0u);
}

}  // namespace
}  // namespace kpsa::engine::ablation
