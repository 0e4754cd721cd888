// The last step of deltaMush nodes, as Compiler::Split gives it, against what the nodes compute.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "base/matrix.h"
#include "graph/geometry.h"
#include "graph/last_step.h"
#include "tests/nodes/driver_rig.h"
#include "tests/nodes/node_support.h"
#include "tests/support/allocations.h"

namespace kpsa::engine {
namespace {

// Two sheets of different sizes, sheared by "a", in one mush "d".
class DeltaMushLastStep : public testing::Test {
 protected:
  DeltaMushLastStep() : g(StandardNodes()) {
    g.add("transformGeometry", "a");
    g.add("deltaMush", "d");
    for (int i : {0, 1}) {
      const std::string element = "[" + std::to_string(i) + "]", mesh = "m" + std::to_string(i);
      const auto sheet = GridMesh(static_cast<Index>(11 + 4 * i), 9,
                                  [](double x, double y) { return 0.2 * std::sin(7 * x) * std::cos(5 * y); });
      g.add("mesh", mesh, {{"mesh", sheet}});
      g.connect(mesh + ".points", "a.inPoints" + element);
      g.connect("a.outPoints" + element, "d.inPoints" + element);
      g.hold("d.mesh" + element, sheet);
    }
    g.vary("a.matrix");
  }
  std::shared_ptr<const LastStep> Step(const std::string& output = "d.outPoints[0]") {
    const Result<Compiler::SplitPoints> split = Compiler().Split(g.graph, g.plug(output));
    EXPECT_TRUE(split.ok()) << split.status().ToString();
    if (!split.ok()) return nullptr;
    ExpectTheSurveys(*split, output);
    in = split->in;
    return split->step;
  }
  // Together with steps under what varies, the same is found.
  void ExpectTheSurveys(const Compiler::SplitPoints& split, const std::string& output) {
    Request request;
    request.outputs.push_back({g.plug(output), {}});
    request.varying = {g.plug("a.matrix")};
    const auto survey = Compiler().SurveyOf(g.graph, request, {PlugRef(), g.plug(output)});
    ASSERT_TRUE(survey.ok()) << survey.status().ToString();
    ASSERT_EQ(survey->split.size(), 2u);
    EXPECT_EQ(survey->split[0].step, nullptr);
    const Compiler::SplitPoints& found = survey->split[1];
    EXPECT_EQ(found.in, split.in);
    ASSERT_EQ(found.step == nullptr, split.step == nullptr);
    if (split.step != nullptr) {
      EXPECT_EQ(found.step->inner_points(), split.step->inner_points());
    }
    const auto steps = Compiler().Steps(g.graph, request);
    ASSERT_TRUE(steps.ok()) << steps.status().ToString();
    ASSERT_EQ(survey->steps.size(), steps->size());
    for (std::size_t s = 0; s < steps->size(); ++s) {
      EXPECT_EQ(survey->steps[s].node, (*steps)[s].node);
      EXPECT_EQ(survey->steps[s].points, (*steps)[s].points);
    }
  }
  void Shear() {
    Matrix4 m = RotationFromEuler({0.3, 0.2, -0.5}, RotateOrder::kXyz);
    m(0, 1) += 0.4, m(2, 0) -= 0.3;
    g.set("a.matrix", m);
  }
  // Runs the step of all points from what comes in now.
  void ExpectTheNodesPoints(const LastStep& step, int geometry) {
    const std::string element = "[" + std::to_string(geometry) + "]";
    g.pull_points("d.outPoints" + element);
    g.pull_points("a.outPoints" + element);
    Shear();
    const std::vector<float> came = g.pull_points("a.outPoints" + element),
                             expected = g.pull_points("d.outPoints" + element);
    ASSERT_EQ(3 * step.points(), came.size());
    PointBuffer inner(step.inner_points()), out(step.points());
    step.Inner(PointBuffer::FromInterleaved(came).view(), inner.view());
    const PointSet all = PointSet::All(static_cast<Index>(step.points())),
                   some = PointSet::Of({3, 4, 50}, all.total());
    EXPECT_EQ(step.InnerOf(some), step.Bind(some)->inner());
    const auto bound = step.Bind(all);
    EXPECT_EQ(step.InnerOf(all), bound->inner());
    AlignedFloats scratch(bound->scratch_floats());
    bound->Run(inner.view(), out.view(), scratch.span());
    ExpectPoints(out.Interleaved(), {expected.begin(), expected.end()}, 2e-6);
    double moved = 0;
    for (std::size_t i = 0; i < came.size(); ++i)
      moved = std::max(moved, std::fabs(double{came[i]} - double{expected[i]}));
    EXPECT_GT(moved, 1e-3);
  }
  void HoldWeights(int geometry) {
    std::vector<float> weights;
    for (int i = 0; i < 9 * (11 + 4 * geometry); ++i) weights.push_back(static_cast<float>(i % 3) / 2);
    g.hold("d.weights[" + std::to_string(geometry) + "]",
           Value(std::make_shared<const WeightMap>(std::move(weights))));
  }

  TestGraph g;
  PlugRef in;
};

TEST_F(DeltaMushLastStep, GivesTheNodesPoints) {
  const auto step = Step();
  ASSERT_NE(step, nullptr);
  EXPECT_EQ(in, g.plug("a.outPoints[0]"));
  EXPECT_EQ(step->inner_points(), step->points());
  EXPECT_GT(step->cost_ns(), 0);
  ExpectTheNodesPoints(*step, 0);
}

TEST_F(DeltaMushLastStep, HasWhatTheNodeHolds) {
  g.hold("d.envelope", 0.5);
  g.hold("d.displacement", 0.7);
  g.hold("d.iterations", 4);
  g.hold("d.smoothingStep", 0.8);
  g.hold("d.distanceWeight", 0.5);
  g.hold("d.pinBorderVertices", Value(false));
  HoldWeights(0);
  const auto step = Step();
  ASSERT_NE(step, nullptr);
  EXPECT_GT(step->inner_points(), step->points());
  ExpectTheNodesPoints(*step, 0);
}

TEST_F(DeltaMushLastStep, IsOfOneGeometry) {
  HoldWeights(1);
  const auto first = Step("d.outPoints[0]");
  EXPECT_EQ(in, g.plug("a.outPoints[0]"));
  const auto second = Step("d.outPoints[1]");
  EXPECT_EQ(in, g.plug("a.outPoints[1]"));
  ASSERT_NE(first, nullptr);
  ASSERT_NE(second, nullptr);
  EXPECT_EQ(first->points(), 99u);
  EXPECT_EQ(first->inner_points(), 99u);
  EXPECT_EQ(second->points(), 135u);
  EXPECT_GT(second->inner_points(), 135u);
  ExpectTheNodesPoints(*first, 0);
  ExpectTheNodesPoints(*second, 1);
}

// It keeps what it reads of the graph's assets.
TEST_F(DeltaMushLastStep, OutlivesItsGraph) {
  std::shared_ptr<const LastStep> step;
  {
    TestGraph other(StandardNodes());
    const auto sheet = GridMesh(9, 9, [](double x, double) { return 0.1 * x * x; });
    other.add("mesh", "m", {{"mesh", sheet}});
    other.add("deltaMush", "d", {{"mesh[0]", sheet}});
    other.connect("m.points", "d.inPoints[0]");
    const auto split = other.compiler.Split(other.graph, other.plug("d.outPoints[0]"));
    ASSERT_TRUE(split.ok()) << split.status().ToString();
    step = split->step;
  }
  ASSERT_NE(step, nullptr);
  const auto bound = step->Bind(PointSet::Of({40}, 81));
  EXPECT_EQ(bound->inner(), (std::vector<Index>{30, 31, 39, 40, 41, 49, 50}));
}

TEST_F(DeltaMushLastStep, RunsWithoutAllocating) {
  if (!KPSA_COUNTS_ALLOCATIONS) GTEST_SKIP() << "allocations are not counted here";
  g.hold("d.envelope", 0.5);
  HoldWeights(0);
  const auto step = Step();
  ASSERT_NE(step, nullptr);
  PointBuffer inner(step->inner_points()), out(step->points());
  const auto bound = step->Bind(PointSet::All(99));
  AlignedFloats scratch(bound->scratch_floats());
  bound->Run(inner.view(), out.view(), scratch.span());  // the first finds out which vectors there are
  StartCountingAllocations();
  bound->Run(inner.view(), out.view(), scratch.span());
  EXPECT_EQ(StopCountingAllocations(), 0);
  StartCountingAllocations();
  step->Bind(PointSet::All(99));
  EXPECT_GT(StopCountingAllocations(), 0);
}

TEST_F(DeltaMushLastStep, IsNoneWhereNothingChanges) {
  g.hold("d.envelope", 0.0);
  EXPECT_EQ(Step(), nullptr);
  g.hold("d.envelope", 1.0);
  EXPECT_NE(Step(), nullptr);
  g.hold("d.iterations", 0);
  EXPECT_EQ(Step(), nullptr);
}

TEST_F(DeltaMushLastStep, IsNoneWhereTheEnvelopeOrTheDisplacementIsDriven) {
  for (const char* attribute : {"d.envelope", "d.displacement"}) {
    const std::string driver = std::string("driver_of_") + (attribute + 2);
    g.add("remapValue", driver, {{"inputValue", 0.5}});
    EXPECT_NE(Step(), nullptr);
    g.connect(driver + ".outValue", attribute);
    EXPECT_EQ(Step(), nullptr);
    ASSERT_TRUE(g.graph.Disconnect(g.plug(attribute)).ok());
  }
}

TEST_F(DeltaMushLastStep, IsNoneUnderAFalloff) {
  g.add("sphereFalloff", "f");
  g.connect("a.outPoints[0]", "f.inPoints[0]");
  g.connect("f.outputWeights[0]", "d.falloffWeights[0]");
  EXPECT_EQ(Step(), nullptr);
  EXPECT_NE(Step("d.outPoints[1]"), nullptr);
  // Of points that nothing drives, too
  ASSERT_TRUE(g.graph.Disconnect(g.plug("d.inPoints[0]")).ok());
  g.hold("d.inPoints[0]", PointsOf(std::vector<float>(3 * 99, 0.5f)));
  EXPECT_EQ(Step(), nullptr);
}

TEST_F(DeltaMushLastStep, OfAnotherMeshIsAnError) {
  g.hold("d.mesh[0]", GridMesh(5, 5, [](double, double) { return 0.0; }));
  const auto split = Compiler().Split(g.graph, g.plug("d.outPoints[0]"));
  ASSERT_FALSE(split.ok());
  EXPECT_NE(split.status().ToString().find("25 points"), std::string::npos) << split.status().ToString();
  Request request;
  request.outputs.push_back({g.plug("a.outPoints[0]"), {}});
  const auto survey = Compiler().SurveyOf(g.graph, request, {g.plug("d.outPoints[0]")});
  ASSERT_FALSE(survey.ok());
  EXPECT_EQ(survey.status().ToString(), split.status().ToString());
}

}  // namespace
}  // namespace kpsa::engine
