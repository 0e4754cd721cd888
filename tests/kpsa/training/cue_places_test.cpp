#include "kpsa/training/cue_places.h"

#include <gtest/gtest.h>

#include "kpsa/training/mode_choice.h"
#include "tests/support/test_graph.h"
#include "tests/support/toy_nodes.h"

namespace kpsa::engine {
namespace {

constexpr Index kMeshPoints = 400;
constexpr double kMove = 20000, kMovePoint = 2, kSmooth = 20000, kSmoothPoint = 10;  // ns, of the toys

// source > lift > shift > blur: two local stages and one that needs neighbours.
class CuePlacesTest : public testing::Test {
 protected:
  CuePlacesTest() : g_(ToyRegistry()) {
    AddStack("a_");
    rig_.graph = &g_.graph;
    rig_.time = g_.plug("time.a");
    AddMesh("a_");
    for (const char* control : {"a_up.a", "a_side.a"}) AddControl(control, false);
  }
  void AddStack(const std::string& prefix) {
    if (prefix == "a_") g_.add("add", "time");
    g_.add("source", prefix + "rest", {{"count", std::int64_t{kMeshPoints}}});
    g_.connect(prefix + "rest.outPoints", AddMove(prefix, "lift", "up") + ".points");
    g_.connect(prefix + "lift.outPoints", AddMove(prefix, "shift", "side") + ".points");
    g_.add("smooth", prefix + "blur", {{"rings", std::int64_t{3}}});
    g_.connect(prefix + "shift.outPoints", prefix + "blur.points");
  }
  std::string AddMove(const std::string& prefix, const std::string& name, const std::string& control) {
    g_.add("add", prefix + control);
    g_.add("move", prefix + name);
    g_.connect(prefix + control + ".out", prefix + name + ".offset");
    return prefix + name;
  }
  void AddMesh(const std::string& prefix) {
    AccelerationTarget::MeshPoints mesh{prefix + "mesh", {}};
    for (const char* stage : {"lift", "shift", "blur"})
      mesh.stages.push_back({stage, g_.plug(prefix + stage + ".outPoints"), true});
    rig_.target.meshes.push_back(std::move(mesh));
    totals_.push_back(kMeshPoints);
  }
  void AddControl(const std::string& plug, bool by_clip) {
    ControlRange& control = rig_.controls.emplace_back();
    control.plug = g_.plug(plug);
    control.by_clip = by_clip;
  }
  CuePlaces Find() {
    Result<CuePlaces> places = FindCuePlaces(rig_, &compiler_, totals_);
    EXPECT_TRUE(places.ok()) << places.status().ToString();
    return std::move(*places);
  }
  double Cost(const CuePlaces& places, const std::vector<CueRef>& cues) {
    const Result<double> cost = CostOfPoints(rig_, &compiler_, totals_, places.stages, cues);
    EXPECT_TRUE(cost.ok()) << cost.status().ToString();
    return *cost;
  }

  TestGraph g_;
  Compiler compiler_;
  TrainingRig rig_;
  std::vector<Index> totals_;
};

// A step with more inner points than its mesh has.
class LargerStep final : public LastStep {
 public:
  std::size_t points() const override { return kMeshPoints; }
  std::size_t inner_points() const override { return kMeshPoints + 7; }
  Index PointOf(Index inner) const override { return inner % kMeshPoints; }
  float cost_ns() const override { return 1; }
  void Inner(ConstPointsView, PointsView) const override {}
  std::unique_ptr<const Bound> Bind(const PointSet&) const override { return nullptr; }
};

// Rows of a mesh come after all that is reconstructed of the one before it.
TEST_F(CuePlacesTest, OutputsComeAfterInnerPointsOfOtherMeshes) {
  AddStack("b_"), AddMesh("b_"), AddControl("b_up.a", false);
  const double one = Cost({}, {{CueKind::kOutput, kMeshPoints + 6}});
  EXPECT_GT(one, 0);
  rig_.split.resize(2);
  rig_.split[0].step = std::make_shared<const LargerStep>();
  EXPECT_EQ(Cost({}, {{CueKind::kOutput, kMeshPoints + 6}}), 0) << "which is behind the points of the first";
  EXPECT_GT(Cost({}, {{CueKind::kOutput, kMeshPoints + 7}}), 0);
  EXPECT_EQ(Cost({}, {{CueKind::kOutput, kMeshPoints + 7 + 6}}), one);
}

// A picture is measured where its rig says, whatever that costs, at points that lie in no rows.
TEST_F(CuePlacesTest, LightIsMeasuredAtItsFirstStage) {
  rig_.target.colors = true;
  const Result<CuePlaces> found = FindCuePlaces(rig_, &compiler_, totals_, 100);
  ASSERT_TRUE(found.ok()) << found.status().ToString();
  ASSERT_EQ(found->places.size(), 1u);
  ASSERT_EQ(found->stages.size(), 1u);
  EXPECT_EQ(found->stages[0].stage, 0u);
  EXPECT_EQ(found->stages[0].points, GoldenSpread(kMeshPoints, 100));
  ASSERT_EQ(found->places[0].size(), 100u);
  for (const CueRef& cue : found->places[0]) EXPECT_EQ(cue.kind, CueKind::kStage);

  // A picture that has no other stage is measured itself
  rig_.target.meshes[0].stages.erase(rig_.target.meshes[0].stages.begin() + 1,
                                     rig_.target.meshes[0].stages.end());
  const CuePlaces plain = Find();
  ASSERT_EQ(plain.places.size(), 1u);
  EXPECT_EQ(plain.places[0].size(), kMeshPoints);
  EXPECT_EQ(plain.places[0][0].kind, CueKind::kOutput);
}

TEST_F(CuePlacesTest, TheDearestIsTheLatestLocalStage) {
  const CuePlaces found = Find();
  ASSERT_EQ(found.places.size(), 2u);
  ASSERT_EQ(found.stages.size(), 2u);
  EXPECT_EQ(found.stages[0].stage, 1u);  // shift
  EXPECT_EQ(found.stages[1].stage, 0u);  // lift
  for (const CuePlace& place : found.places) {
    EXPECT_EQ(place.size(), kMeshPoints);  // few enough to be candidates all
    for (const CueRef& cue : place) EXPECT_EQ(cue.kind, CueKind::kStage);
  }
  EXPECT_DOUBLE_EQ(found.full_cost,
                   2 * (kMove + kMovePoint * kMeshPoints) + kSmooth + kSmoothPoint * kMeshPoints);
}

TEST_F(CuePlacesTest, WhatClipsDriveVariesAsWell) {
  const CuePlaces free = Find();
  for (ControlRange& control : rig_.controls) control.by_clip = true;
  const CuePlaces driven = Find();
  EXPECT_EQ(driven.full_cost, free.full_cost);
  EXPECT_EQ(driven.places, free.places);
  EXPECT_EQ(driven.stages[0].stage, 1u);
}

TEST_F(CuePlacesTest, PointsCostWhatTheCompilerKeepsForThem) {
  const CuePlaces found = Find();
  const CueRef shift = found.places[0][200], lift = found.places[1][200], scalar{CueKind::kScalar, 0};
  EXPECT_EQ(Cost(found, {}), 0);
  EXPECT_EQ(Cost(found, {scalar}), 0);
  EXPECT_DOUBLE_EQ(Cost(found, {lift}), kMove + kMovePoint);
  EXPECT_DOUBLE_EQ(Cost(found, {shift}), 2 * (kMove + kMovePoint));
  EXPECT_DOUBLE_EQ(Cost(found, {{CueKind::kOutput, 200}}),
                   2 * (kMove + 7 * kMovePoint) + kSmooth + kSmoothPoint);
  // The steps of an earlier point serve a later one, too, but for copies
  EXPECT_NEAR(Cost(found, {shift, found.places[1][100]}), 2 * kMove + 3 * kMovePoint, 50);
}

TEST_F(CuePlacesTest, WhatMeshesShareIsPaidOnce) {
  const double one = Find().full_cost;
  AddMesh("a_");  // the same points once more
  const CuePlaces found = Find();
  EXPECT_EQ(found.full_cost, one);
  AddStack("b_");
  AddMesh("b_");
  for (const char* control : {"b_up.a", "b_side.a"}) AddControl(control, false);
  EXPECT_DOUBLE_EQ(Find().full_cost, 2 * one);
}

TEST_F(CuePlacesTest, SmallMeshesKeepCandidatesBesideLargeOnes) {
  AddStack("b_");
  AddMesh("b_");
  AddControl("b_up.a", false);
  g_.hold("a_rest.count", std::int64_t{30000});
  totals_[0] = 30000;
  for (const CandidateStage& stage : Find().stages) EXPECT_GE(stage.points.size(), 50u) << stage.mesh;
}

}  // namespace
}  // namespace kpsa::engine
