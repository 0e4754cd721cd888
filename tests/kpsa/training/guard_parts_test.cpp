#include "kpsa/training/guard_parts.h"

#include <gtest/gtest.h>

#include "kpsa/calibration.h"
#include "kpsa/training/frame_cost.h"
#include "tests/support/test_graph.h"
#include "tests/support/toy_nodes.h"

namespace kpsa::engine {
namespace {

constexpr Index kGuardedPoints = 400;  // four tiles

// Eight meshes of their own controls: source > lift > blur.
class GuardParts : public testing::Test {
 protected:
  GuardParts() : g_(ToyRegistry()) {
    g_.add("add", "time");
    g_.add("add", "elsewhere");
    rig_.graph = &g_.graph;
    rig_.time = g_.plug("time.a");
    rig_.set_clip = [](auto) { return Status(); };
    for (const char letter : std::string("abcdefgh")) AddMesh(std::string(1, letter) + "_");
    for (const char* name : {"a_up", "b_up", "elsewhere"})
      signals_.push_back({std::string(name) + ".out", g_.plug(std::string(name) + ".out"), false, false});
    subspace_.cue_mean = subspace_.cue_scale = {0, 1};
    subspace_.soft_cache.offsets = {0, 1, 2};
    subspace_.cues.resize(2);
    subspace_.patches = MakePatchLayout(std::vector<std::size_t>(8, 4));
  }
  void AddMesh(const std::string& prefix) {
    g_.add("source", prefix + "rest", {{"count", std::int64_t{kGuardedPoints}}});
    g_.add("add", prefix + "up");
    g_.add("move", prefix + "lift");
    g_.connect(prefix + "up.out", prefix + "lift.offset");
    g_.connect(prefix + "rest.outPoints", prefix + "lift.points");
    g_.add("smooth", prefix + "blur", {{"rings", std::int64_t{3}}});
    g_.connect(prefix + "lift.outPoints", prefix + "blur.points");
    AccelerationTarget::MeshPoints mesh{prefix + "mesh", {}};
    for (const char* stage : {"lift", "blur"})
      mesh.stages.push_back({stage, g_.plug(prefix + stage + ".outPoints"), true});
    rig_.target.meshes.push_back(std::move(mesh));
    ControlRange& control = rig_.controls.emplace_back();
    control.plug = g_.plug(prefix + "up.a");
    subspace_.outputs.push_back({prefix + "mesh@blur", kGuardedPoints, "blur"});
  }
  // reads: of each tile of the meshes, the rows that it reads.
  std::vector<std::uint64_t> Find(std::vector<std::vector<std::uint32_t>> reads) {
    reads.resize(32);
    subspace_.tiles.clear();
    for (std::size_t m = 0; m < 8; ++m) {
      TileData data;
      data.points = kGuardedPoints, data.inputs = 2;
      data.ranks = data.wide = {0, 0, 0, 0};
      data.direct = {0, 0, 0, 0};
      for (std::size_t t = 0; t < 4; ++t) {
        const auto& rows = reads[4 * m + t];
        data.counts.push_back(static_cast<std::uint32_t>(rows.size()));
        data.columns.insert(data.columns.end(), rows.begin(), rows.end());
      }
      data.mean = AlignedArray<float>(3 * 13 * kPanelPoints);
      Result<TileMap> map = TileMap::Make(std::move(data), "tiles");
      EXPECT_TRUE(map.ok()) << map.status().ToString();
      subspace_.tiles.push_back(std::move(*map));
    }
    const Result<std::vector<std::uint64_t>> found =
        FindGuardedPatches(rig_, &compiler_, {}, signals_, signals_.size(), subspace_);
    EXPECT_TRUE(found.ok()) << found.status().ToString();
    return *found;
  }

  TestGraph g_;
  Compiler compiler_;
  TrainingRig rig_;
  std::vector<Signal> signals_;
  Subspace subspace_;
};

TEST_F(GuardParts, SpeakOfThePatchesWhosePointsNeedThem) {
  ASSERT_EQ(subspace_.patches.tiles, 1u);
  ASSERT_EQ(subspace_.patches.patches, 32u);
  EXPECT_EQ(Find({}), (std::vector<std::uint64_t>{0x0f, 0xf0, kAllPatches}));
}

TEST_F(GuardParts, SpeakOfThePatchesWhoseCuesNeedThem) {
  CueDescription& point = subspace_.cues[0];  // of the first mesh
  point.mesh = 0, point.stage = "lift", point.point = 7;
  subspace_.cues[1].kind = CueDescription::Kind::kScalar;
  subspace_.cues[1].plug = "elsewhere.out";
  EXPECT_EQ(Find({{}, {1}, {}, {}, {}, {0}, {0, 1}, {}}), (std::vector<std::uint64_t>{0x6f, 0xf0, 0x42}));
  subspace_.cues[1] = {};
  subspace_.cues[1].kind = CueDescription::Kind::kProduct;
  subspace_.cues[1].factors = {{"elsewhere.out", {}}, {"b_up.out", {}}};
  EXPECT_EQ(Find({{1}}), (std::vector<std::uint64_t>{0x0f, 0xf1, 0x01}));
  // A quarter of them, and more, which is all
  EXPECT_EQ(Find({{1}, {1}, {1}, {1}}), (std::vector<std::uint64_t>{0x0f, 0xff, 0x0f}));
  EXPECT_EQ(Find({{1}, {1}, {1}, {1}, {}, {}, {}, {}, {1}}),
            (std::vector<std::uint64_t>{0x0f, kAllPatches, 0x10f}));
}

// A judge's guards, patch by patch: the largest of those that speak of it.
TEST(GuardPartsOfJudges, AreTheLargestThatSpeakOfAPatch) {
  std::vector<TrainedRange> ranges = {{"a", 0, 1, 2}, {"b", 0, 1, 1}, {"c", 0, 1, 1}, {"d", 0, 1, 1}};
  ranges[0].patches = 0b0011, ranges[1].patches = 0b0110, ranges[3].patches = 0b1000;
  std::vector<ScoreJudge> judges(3);
  const std::vector<std::vector<float>> entries = {{2, 1.5f, 1, 9}, {0.5f, 0, 3, 9}, {1, 1, 1, 9}};
  AskGuards(ranges, {1, 1, 1, 0}, entries, 4, &judges);
  EXPECT_EQ(judges[0].guard, 0);
  const auto half_way = static_cast<float>(GuardWeight(0, 1, 2, 2));
  EXPECT_GT(half_way, 0.4f);
  EXPECT_EQ(judges[0].guards_of_patches, (std::vector<float>{half_way, half_way, half_way, 0}));
  EXPECT_EQ(judges[1].guard, 1);
  EXPECT_TRUE(judges[1].guards_of_patches.empty());
  EXPECT_EQ(judges[2].guard, 0);
  EXPECT_TRUE(judges[2].guards_of_patches.empty());
  EXPECT_FLOAT_EQ(static_cast<float>(WithoutPatches(judges[0]).guard), half_way);
}

}  // namespace
}  // namespace kpsa::engine
