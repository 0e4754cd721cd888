// Some points of the face's stack: the same bits as in the full evaluation, at a cost that follows their
// number.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>

#include "tests/cli/rig_run.h"
#include "tests/support/instruction_count.h"

namespace kpsa::engine {
namespace {

class FaceSubset : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    RigOptions rest;
    rest.rest = true;
    Result<Rig> rig = LoadRig(AcceleratedRegistry(), KPSA_SCENES_DIR "/face/face.yaml", rest);
    ASSERT_TRUE(rig.ok()) << rig.status().ToString();
    rig_ = std::make_unique<Rig>(std::move(*rig));
    std::mt19937 random(2);
    pose_ = SmoothPoses(*rig_, 2, 0.8)[1];  // every control away from rest: no deformer has nothing to do
  }
  static void TearDownTestSuite() { rig_.reset(); }

  static std::unique_ptr<Evaluator> Start(const std::string& stage, const PointSet& points) {
    Request request;
    request.varying = VaryingPlugs(*rig_);
    const Stage* found = rig_->scene.meshes[0].FindStage(stage);
    if (found == nullptr) ADD_FAILURE() << stage;
    request.outputs.push_back({found->points, points});
    Result<std::shared_ptr<const Plan>> plan = compiler_.Compile(*rig_->graph, request);
    EXPECT_TRUE(plan.ok()) << plan.status().ToString();
    auto evaluator = std::make_unique<Evaluator>(*plan);
    for (std::size_t c = 0; c < rig_->controls.size(); ++c) {
      const PlugRef& plug = rig_->controls[c].plug;
      const Index varying = (*plan)->FindVarying(plug);
      if (varying != kNoIndex)
        evaluator->Set(varying, pose_[c],
                       (*plan)->varying()[varying].type == Type::kDouble3 ? plug.component : -1);
    }
    const Status status = evaluator->Evaluate();
    EXPECT_TRUE(status.ok()) << status.ToString();
    return evaluator;
  }
  static Index Total() { return static_cast<Index>(rig_->scene.meshes[0].mesh().point_count()); }
  static std::vector<Index> RandomPoints(std::size_t count, unsigned seed) {
    std::vector<Index> points(Total());
    for (Index i = 0; i < points.size(); ++i) points[i] = i;
    std::shuffle(points.begin(), points.end(), std::mt19937(seed));
    points.resize(count);
    std::sort(points.begin(), points.end());
    return points;
  }
  static std::optional<std::uint64_t> Instructions(Evaluator* evaluator) {
    evaluator->Invalidate();
    return CountInstructions([&] { EXPECT_TRUE(evaluator->Evaluate().ok()); });
  }
  // Points that all steps together compute.
  static double PointsComputed(const Plan& plan) {
    double points = 0;
    for (const Plan::StepInfo& info : plan.infos()) points += info.points;
    return points;
  }

  static inline std::unique_ptr<Rig> rig_;
  static inline std::vector<double> pose_;
  static inline Compiler compiler_;
};

TEST_F(FaceSubset, HasTheBitsOfTheWhole) {
  std::vector<std::size_t> sizes = {1, 2, 3, 4, 7, 8, 9, 15, 16, 17, 31, 33, 42, 64, 65};
  std::vector<std::vector<float>> wholes;
  for (const Stage& stage : rig_->scene.meshes[0].stages) {
    SCOPED_TRACE(stage.name);
    const std::unique_ptr<Evaluator> full = Start(stage.name, {});
    const ConstPointsView all = full->Points(0);
    wholes.emplace_back(all.x, all.x + all.count);
    for (std::size_t size : sizes) {
      const std::vector<Index> points = RandomPoints(size, static_cast<unsigned>(100 + size));
      const std::unique_ptr<Evaluator> some = Start(stage.name, PointSet::Of(points, Total()));
      const ConstPointsView part = some->Points(0);
      ASSERT_EQ(part.count, size);
      std::size_t different = 0;
      for (std::size_t i = 0; i < size; ++i) {
        const float whole[] = {all.x[points[i]], all.y[points[i]], all.z[points[i]]},
                    own[] = {part.x[i], part.y[i], part.z[i]};
        different += std::memcmp(whole, own, sizeof(own)) != 0;
      }
      EXPECT_EQ(different, 0u) << size << " points";
    }
  }
  for (std::size_t s = 1; s < wholes.size(); ++s)
    EXPECT_FALSE(SameBytes(wholes[s - 1], wholes[s])) << "stage " << s << " does nothing";
}

TEST_F(FaceSubset, OnePercentCostsThreePercentOfTheStack) {
  const std::size_t percent = Total() / 100;
  double whole_before = 0;
  for (const std::string stage : {"skin", "cheekModR"}) {
    const auto all = Instructions(Start(stage, {}).get());
    const auto fifth = Instructions(Start(stage, PointSet::Of(RandomPoints(Total() / 5, 7), Total())).get());
    const auto some = Instructions(Start(stage, PointSet::Of(RandomPoints(percent, 8), Total())).get());
    const auto tenth = Instructions(Start(stage, PointSet::Of(RandomPoints(Total() / 10, 9), Total())).get());
    if (!all || !fifth || !some || !tenth) GTEST_SKIP() << "instructions cannot be counted here";
    // The constant: what comes before the points, for the joints and control points that a vector of points
    // needs. A line through all points and a fifth of them has it; few points are touched by fewer deformers.
    const double whole = static_cast<double>(*all);
    const double constant = static_cast<double>(*fifth) - (whole - static_cast<double>(*fifth)) / 4;
    const auto share = [&](std::uint64_t part) {
      return (static_cast<double>(part) - constant) / (whole - constant);
    };
    std::printf("%s: all %zu points %.0f instructions, none %.0f; 1 %% costs %.2f %%, 10 %% %.2f %%\n",
                stage.c_str(), static_cast<std::size_t>(Total()), whole, constant, 100 * share(*some),
                100 * share(*tenth));
    EXPECT_GT(constant, 0) << stage;
    EXPECT_LE(share(*some), 0.03) << stage;
    EXPECT_GT(share(*tenth), 0.03) << stage;  // the measure sees ten times the points
    EXPECT_GT(whole, 1.2 * whole_before) << stage;
    whole_before = whole;
  }
}

// Behind the deltaMush a patch drags its rings in; what it costs follows the points that the plan asks for.
TEST_F(FaceSubset, APatchBehindTheMushCostsItsRings) {
  const PlugRef iterations = *rig_->graph->FindPlug("mush.iterations");
  ASSERT_TRUE(
      rig_->graph->Set(iterations, std::int64_t{1}).ok());  // each instruction takes a microsecond to count
  std::vector<Index> patch;
  for (Index p = 2000; p < 2000 + Total() / 100; ++p) patch.push_back(p);
  const std::unique_ptr<Evaluator> whole = Start("mush", {}),
                                   part = Start("mush", PointSet::Of(patch, Total()));
  ASSERT_TRUE(rig_->graph->Set(iterations, std::int64_t{10}).ok());
  const auto all = Instructions(whole.get()), some = Instructions(part.get());
  if (!all || !some) GTEST_SKIP() << "instructions cannot be counted here";
  const double cost = static_cast<double>(*some) / static_cast<double>(*all);
  const double points = PointsComputed(part->plan()) / PointsComputed(whole->plan());
  std::printf("mush: %zu points in a patch compute %.1f %% of the points and cost %.1f %%\n", patch.size(),
              100 * points, 100 * cost);
  EXPECT_LT(points, 0.6);
  EXPECT_LE(cost, 1.3 * points + 0.02);
}

}  // namespace
}  // namespace kpsa::engine
