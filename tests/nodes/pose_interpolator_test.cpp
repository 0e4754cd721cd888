#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>

#include "base/matrix.h"
#include "nodes/kernels/pose_weights.h"
#include "tests/nodes/driver_rig.h"

namespace kpsa::engine {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180;

Quaternion Turn(double x, double y, double z) {
  return QuaternionFromRotation(
      RotationFromEuler({x * kDegree, y * kDegree, z * kDegree}, RotateOrder::kXyz));
}

std::vector<Quaternion> ManyPoses() {
  return {Turn(0, 0, 0),   Turn(90, 0, 0),    Turn(0, 60, 0),
          Turn(0, 0, -80), Turn(40, -50, 10), Turn(0, -45, 100)};
}
std::vector<std::string> Names(std::size_t count) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < count; ++i) names.push_back("pose" + std::to_string(i));
  return names;
}

std::vector<double> At(const PoseWeights& weights, Quaternion q) {
  std::vector<double> result(weights.pose_count());
  weights.Run(q, result);
  return result;
}

TEST(PoseInterpolator, OneAtItsPoseAndZeroAtTheOthers) {
  const std::vector<Quaternion> poses = ManyPoses();
  for (const PoseBasis basis : {PoseBasis::kGaussian, PoseBasis::kThinPlate, PoseBasis::kLinear}) {
    for (const PoseSpace::Part part : {PoseSpace::Part::kSwingAndTwist, PoseSpace::Part::kSwing}) {
      for (const bool normalize : {false, true}) {
        PoseSettings settings;
        settings.space = {part, {0, 0.6, 0.8}};
        settings.basis = basis;
        settings.normalize = normalize;
        const Result<PoseWeights> weights = PoseWeights::Bind(settings, poses, Names(poses.size()));
        ASSERT_TRUE(weights.ok()) << weights.status().ToString();
        for (std::size_t i = 0; i < poses.size(); ++i) {
          for (const double sign : {1.0, -1.0}) {  // q and -q are the same rotation
            const Quaternion q{poses[i].x * sign, poses[i].y * sign, poses[i].z * sign, poses[i].w * sign};
            const std::vector<double> w = At(*weights, q);
            for (std::size_t j = 0; j < w.size(); ++j) EXPECT_NEAR(w[j], i == j ? 1 : 0, 1e-9);
          }
        }
      }
    }
  }
}

TEST(PoseInterpolator, BetweenTwoPosesTheyShare) {
  const std::vector<Quaternion> poses = {Turn(0, 0, 0), Turn(80, 0, 0)};
  for (const PoseBasis basis : {PoseBasis::kGaussian, PoseBasis::kLinear}) {
    PoseSettings settings;
    settings.basis = basis;
    const PoseWeights weights = *PoseWeights::Bind(settings, poses, Names(2));
    const std::vector<double> middle = At(weights, Turn(40, 0, 0));
    EXPECT_NEAR(middle[0], middle[1], 1e-12);
    const std::vector<double> nearer = At(weights, Turn(60, 0, 0));
    EXPECT_GT(nearer[1], nearer[0] + 0.1);
    settings.normalize = true;
    const PoseWeights normal = *PoseWeights::Bind(settings, poses, Names(2));
    const std::vector<double> shares = At(normal, Turn(20, 35, 0));
    EXPECT_NEAR(shares[0] + shares[1], 1, 1e-12);
    EXPECT_GE(std::min(shares[0], shares[1]), 0);
  }
  // Analytic: a Gaussian of one pose
  PoseSettings settings;
  settings.radius = 0.5;
  const PoseWeights one = *PoseWeights::Bind(settings, std::vector<Quaternion>{Turn(0, 0, 0)}, Names(1));
  const double chord = 2 * std::sin(15 * kDegree);
  EXPECT_NEAR(At(one, Turn(0, 30, 0))[0], std::exp(-chord * chord / 0.25), 1e-12);
}

TEST(PoseInterpolator, PartsSeeTheirOwnPart) {
  const Double3 axis{1, 0, 0};
  PoseSettings settings;
  settings.space = {PoseSpace::Part::kSwing, axis};
  const PoseWeights swing =
      *PoseWeights::Bind(settings, std::vector<Quaternion>{Turn(0, 0, 0), Turn(0, 70, 0)}, Names(2));
  settings.space.part = PoseSpace::Part::kTwist;
  const PoseWeights twist =
      *PoseWeights::Bind(settings, std::vector<Quaternion>{Turn(0, 0, 0), Turn(70, 0, 0)}, Names(2));
  Random random(3);
  for (int i = 0; i < 20; ++i) {
    const Quaternion turn = Turn(60 * random.Signed(), 0, 0),
                     bend = Turn(0, 60 * random.Signed(), 50 * random.Signed());
    // A twist comes first: it does not move the axis. A swing after it does not change the twist.
    const std::vector<double> a = At(swing, bend), b = At(swing, bend * turn);
    EXPECT_NEAR(a[0], b[0], 1e-9);
    EXPECT_NEAR(a[1], b[1], 1e-9);
    const std::vector<double> c = At(twist, turn),
                              d = At(twist, Normalized(Quaternion{0, 0.2, -0.1, 1}) * turn);
    EXPECT_NEAR(c[0], d[0], 1e-9);
    EXPECT_NEAR(c[1], d[1], 1e-9);
  }
}

TEST(PoseInterpolator, RegularizationSmooths) {
  const std::vector<Quaternion> poses = ManyPoses();
  PoseSettings settings;
  settings.regularization = 0.5;
  const PoseWeights weights = *PoseWeights::Bind(settings, poses, Names(poses.size()));
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const double own = At(weights, poses[i])[i];
    EXPECT_GT(own, 0.3);
    EXPECT_LT(own, 0.95);
  }
}

TEST(PoseInterpolator, ErrorsNameThePoses) {
  const auto error = [](PoseSettings settings, std::vector<Quaternion> poses) {
    const Result<PoseWeights> weights = PoseWeights::Bind(settings, poses, Names(poses.size()));
    return weights.ok() ? std::string("no error") : weights.status().ToString();
  };
  EXPECT_EQ(error({}, {}), "there is no pose");
  EXPECT_EQ(error({}, {Turn(0, 0, 0), Turn(10, 0, 0), Turn(370, 0, 0)}),
            "the poses \"pose1\" and \"pose2\" are the same rotation");
  PoseSettings swing;
  swing.space.part = PoseSpace::Part::kSwing;
  EXPECT_EQ(error(swing, {Turn(0, 0, 0), Turn(50, 0, 0)}),
            "the poses \"pose0\" and \"pose1\" are the same rotation, as far as swing is concerned");
  PoseSettings linear;
  linear.basis = PoseBasis::kLinear;
  EXPECT_NE(error(linear, {Turn(0, 0, 0)}).find("one pose"), std::string::npos);
  PoseSettings wide;  // so wide that all functions look alike
  wide.radius = 1e6;
  EXPECT_NE(error(wide, ManyPoses()).find("no stable interpolation"), std::string::npos);
  wide.regularization = -1;
  EXPECT_NE(error(wide, ManyPoses()).find("regularization"), std::string::npos);
}

TEST(PoseInterpolator, TheNodeIsRelativeToRest) {
  const Matrix4 rest = ComposeTrs({1, 2, 3}, Turn(10, -70, 30), {2, 2, 2});
  TestGraph g{NodesUnderTest()};
  g.add("poseInterpolator", "p",
        {{"restMatrix", rest},
         {"poseAngles", std::vector<double>{0, 0, 0, 90 * kDegree, 0, 0, 0, 45 * kDegree, 0}}});
  g.vary("p.matrix");
  for (int i = 0; i < 4; ++i) g.want("p.outputWeight[" + std::to_string(i) + "]");
  const auto weights = [&](const Matrix4& matrix) {
    g.set("p.matrix", matrix);
    std::vector<double> w;
    for (int i = 0; i < 4; ++i) w.push_back(g.pull<double>("p.outputWeight[" + std::to_string(i) + "]"));
    return w;
  };
  const auto expect = [&](const Matrix4& turn, const std::vector<double>& expected) {
    const std::vector<double> w = weights(rest * turn);
    for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(w[i], expected[i], 1e-9);
  };
  expect(Matrix4(), {1, 0, 0, 0});
  expect(RotationFromEuler({90 * kDegree, 0, 0}, RotateOrder::kXyz), {0, 1, 0, 0});
  expect(Translation({5, 0, 0}) * RotationFromEuler({0, 45 * kDegree, 0}, RotateOrder::kXyz), {0, 0, 1, 0});
  for (const auto& [attribute, value, message] : std::vector<std::tuple<std::string, Value, std::string>>{
           {"poseAngles", std::vector<double>{}, "poseAngles: there are no poses"},
           {"poseAngles", std::vector<double>{1, 2}, "three angles a pose, found 2"},
           {"poseAngles", std::vector<double>{0, 0, 0, 0, 0, 0},
            "the poses \"0\" and \"1\" are the same rotation"}}) {
    TestGraph bad{NodesUnderTest()};
    bad.add("poseInterpolator", "p", {{attribute, value}});
    bad.vary("p.matrix");
    const Status status = bad.try_pull("p.outputWeight[0]");
    EXPECT_FALSE(status.ok());
    EXPECT_NE(status.ToString().find(message), std::string::npos) << status.ToString();
  }
}

}  // namespace
}  // namespace kpsa::engine
