#include "nodes/kernels/jiggle.h"

#include <algorithm>
#include <cmath>

#include "graph/frames.h"
#include "tests/nodes/driver_rig.h"

namespace kpsa::engine {
namespace {

// A sheet that a matrix moves, and that jiggles.
struct JiggleRig {
  TestGraph g{NodesUnderTest()};
  std::shared_ptr<const Mesh> mesh = GridMesh(9, 7, [](double x, double y) { return 0.1 * x * y; });
  explicit JiggleRig(const std::vector<std::pair<std::string, Value>>& values = {},
                     const PointSet& points = {}) {
    g.add("mesh", "m", {{"mesh", mesh}});
    g.add("transformGeometry", "move");
    g.add("jiggle", "j", values);
    g.connect("m.points", "move.inPoints[0]");
    g.connect("move.outPoints[0]", "j.inPoints[0]");
    g.vary("move.matrix");
    g.vary("j.time");
    g.want("j.outPoints[0]", points);
  }
  Status Try(double time, double height) {
    g.set("j.time", time);
    g.set("move.matrix", Translation({0, 0, height}));
    return g.try_pull("j.outPoints[0]");
  }
  // How high the sheet is, seen at its first point.
  double At(double time, double height) {
    const Status status = Try(time, height);
    EXPECT_TRUE(status.ok()) << status.ToString();
    const ConstPointsView points = g.evaluator->Points(g.want("j.outPoints[0]"));
    return static_cast<double>(points.z[0]) - std::as_const(mesh->data()).rest.view().z[0];
  }
};

TEST(Jiggle, SwingsAsTheSpringSays) {
  JiggleRig rig({{"stiffness", 0.3}, {"damping", 0.2}});
  double place = 0, velocity = 0;
  EXPECT_EQ(rig.At(0, 0), 0);
  double most = 0;
  for (int frame = 1; frame < 200; ++frame) {
    velocity = velocity * 0.8 + 0.3 * (1 - place);
    place += velocity;
    EXPECT_NEAR(rig.At(frame / 24.0, 1), place, 1e-6) << frame;
    most = std::max(most, place);
  }
  EXPECT_GT(most, 1.2);         // it swings beyond its goal
  EXPECT_NEAR(place, 1, 1e-6);  // and comes to rest there
}

TEST(Jiggle, FullStiffnessAndDampingFollowAtOnceAndNoStiffnessStays) {
  JiggleRig stiff({{"stiffness", 1.0}, {"damping", 1.0}}), loose({{"stiffness", 0.0}});
  JiggleRig off({{"envelope", 0.0}}), hidden({{"jiggleWeight", 0.0}}),
      half({{"stiffness", 0.0}, {"jiggleWeight", 0.5}});
  for (int frame = 0; frame < 5; ++frame) {
    EXPECT_NEAR(stiff.At(frame / 24.0, frame), frame, 1e-6);
    EXPECT_NEAR(loose.At(frame / 24.0, frame), 0, 1e-6);
    EXPECT_NEAR(half.At(frame / 24.0, frame), 0.5 * frame, 1e-6);
    EXPECT_NEAR(off.At(frame / 24.0, frame), frame, 1e-6);
    EXPECT_NEAR(hidden.At(frame / 24.0, frame), frame, 1e-6);
  }
}

TEST(Jiggle, AFrameMayBeEvaluatedAgain) {
  JiggleRig once, twice;
  for (int frame = 0; frame < 20; ++frame) {
    const double height = std::sin(frame * 0.7);
    twice.At(frame / 24.0, -3);  // what was posed there before counts for nothing
    EXPECT_EQ(twice.At(frame / 24.0, height), once.At(frame / 24.0, height)) << frame;
  }
}

TEST(Jiggle, LongFramesTakeTheStepsInBetween) {
  // Goals that move evenly: every frame, and every fourth one
  JiggleRig fine, coarse;
  for (int frame = 0; frame <= 40; ++frame) {
    const double height = 0.05 * frame, at = fine.At(frame / 24.0, height);
    if (frame % 4 == 0) {
      EXPECT_NEAR(coarse.At(frame / 24.0, height), at, 1e-6) << frame;
    }
  }
  // A pause that is too long starts anew
  EXPECT_NEAR(coarse.At(100, 7), 7, 1e-6);
}

TEST(Jiggle, GoingBackIsRefusedAndSaysSo) {
  JiggleRig rig;
  rig.At(1, 0);
  rig.At(1.5, 1);
  const Status status = rig.Try(1.25, 1);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.kind(), ErrorKind::kEvaluation);
  EXPECT_NE(status.ToString().find("\"j\""), std::string::npos) << status.ToString();
  EXPECT_NE(status.ToString().find("cannot go back to 1.25 s after 1.5 s"), std::string::npos);
  JiggleRig straight;
  straight.At(1, 0);
  straight.At(1.5, 1);
  EXPECT_EQ(rig.At(1.75, 1), straight.At(1.75, 1));  // what was refused left no trace
}

TEST(Jiggle, FramesRunInOrderWhateverIsAsked) {
  JiggleRig rig;
  ASSERT_TRUE(rig.g.compile().ok());
  EXPECT_EQ(rig.g.plan->stateful_node(), "j");
  const auto run = [&](int threads, int block) {
    FrameOptions options;
    options.threads = threads;
    options.block = block;
    std::vector<float> heights;
    const Status status = EvaluateFrames(
        rig.g.plan, 50, options,
        [&](std::size_t frame, Evaluator& e) {
          for (Index v = 0; v < 2; ++v) {
            if (e.plan().varying()[v].plug == rig.g.plug("j.time")) {
              e.Set(v, static_cast<double>(frame) / 24);
            } else {
              e.Set(v, Translation({0, 0, std::sin(0.3 * static_cast<double>(frame))}));
            }
          }
        },
        [&](std::size_t, const Evaluator& e, const Status& evaluated) {
          heights.push_back(e.Points(0).z[5]);
          return evaluated;
        });
    EXPECT_TRUE(status.ok()) << status.ToString();
    return heights;
  };
  const std::vector<float> one = run(1, 1);
  EXPECT_EQ(one.size(), 50u);
  EXPECT_EQ(run(4, 8), one);
}

TEST(Jiggle, SubsetsHaveTheBitsOfTheWhole) {
  JiggleRig whole;
  const PointSet some = PointSet::Of({2, 30, 31, 62}, whole.mesh->point_count());
  JiggleRig part({}, some);
  for (int frame = 0; frame < 12; ++frame) {
    whole.At(frame / 24.0, frame % 3);
    ASSERT_TRUE(part.Try(frame / 24.0, frame % 3).ok());
    const ConstPointsView all = whole.g.evaluator->Points(0), few = part.g.evaluator->Points(0);
    ASSERT_EQ(few.count, some.size());
    for (Index i = 0; i < some.size(); ++i) EXPECT_EQ(few.z[i], all.z[some[i]]);
  }
}

}  // namespace
}  // namespace kpsa::engine
