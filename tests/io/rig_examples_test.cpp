// The rigs of this repository, built and evaluated: scenes/ and the example of the rig format on the shared head.
#include <algorithm>
#include <filesystem>

#include "graph/compiler.h"
#include "graph/evaluator.h"
#include "tests/io/rig_fixture.h"
#include "tests/support/shared_files.h"

namespace kpsa {
namespace {

std::string SourceFile(const std::string& path) { return std::string(KPSA_SOURCE_DIR) + "/" + path; }

// A rig with all its controls varying.
class Player {
 public:
  explicit Player(const std::string& path, const RigOptions& options = {}) {
    Result<Rig> loaded = LoadRig(StandardRegistry(), path, options);
    EXPECT_TRUE(loaded.ok()) << loaded.status().ToString();
    if (!loaded.ok()) return;
    rig = std::move(*loaded);
    EXPECT_TRUE(rig.notes.empty()) << fmt::format("{}", fmt::join(rig.notes, "\n"));
    Request request;
    request.varying.push_back(rig.scene.time);
    for (const Control& control : rig.controls) {
      if (rig.graph->FindConnection(control.plug) == nullptr) request.varying.push_back(control.plug);
    }
    for (const CharacterMesh& mesh : rig.scene.meshes) {
      request.outputs.push_back({mesh.points, {}});
      if (const Stage* own = mesh.FindStage("gltf")) request.outputs.push_back({own->points, {}});
    }
    Result<std::shared_ptr<const Plan>> plan = compiler.Compile(*rig.graph, request);
    EXPECT_TRUE(plan.ok()) << plan.status().ToString();
    if (plan.ok()) evaluator = std::make_unique<Evaluator>(*plan);
  }
  void Set(const std::string& name, double value) {
    const Result<PlugRef> plug = rig.graph->FindPlug(name);
    ASSERT_TRUE(plug.ok()) << plug.status().ToString();
    const Result<Index> varying = evaluator->FindVarying(*rig.graph, *plug);
    ASSERT_TRUE(varying.ok()) << varying.status().ToString();
    evaluator->Set(*varying, value, plug->component);
  }
  // Final points and those of the file's own stages, of the first mesh.
  std::vector<Double3> Points(Index output = 0) {
    const Status status = evaluator->Evaluate();
    EXPECT_TRUE(status.ok()) << status.ToString();
    const ConstPointsView view = evaluator->Points(output);
    std::vector<Double3> points;
    for (std::size_t i = 0; i < view.count; ++i) points.push_back({view.x[i], view.y[i], view.z[i]});
    return points;
  }
  Double3 Vertex(const std::vector<Double3>& points, Index vertex) const {
    return points[rig.scene.meshes[0].mesh().data().vertex_to_point[vertex]];
  }

  Rig rig;
  Compiler compiler;
  std::unique_ptr<Evaluator> evaluator;
};

double MaxDistance(const std::vector<Double3>& a, const std::vector<Double3>& b) {
  EXPECT_EQ(a.size(), b.size());
  double worst = 0;
  for (std::size_t i = 0; i < a.size() && i < b.size(); ++i) {
    const double d = Length(a[i] - b[i]);
    worst = d <= worst ? worst : d;
    if (!(d < 1e30)) worst = 1e30;
  }
  return worst;
}

void ExpectRestsAndPlays(const std::string& path) {
  RigOptions rest;
  rest.rest = true;
  Player player(path, rest);
  ASSERT_NE(player.evaluator, nullptr);
  // At rest no deformer moves anything
  EXPECT_LT(MaxDistance(player.Points(0), player.Points(1)), 1e-5 * player.rig.rest_diagonal);
  for (const CharacterClip& clip : player.rig.scene.clips) {
    RigOptions options;
    options.clip = clip.id;
    Player playing(path, options);
    ASSERT_NE(playing.evaluator, nullptr);
    double moved = 0;  // clips may pass through the rest pose in between
    for (double at : {0.17, 0.5, 0.71}) {
      playing.Set("time.time", clip.duration * at);
      moved = std::max(moved, MaxDistance(playing.Points(0), player.Points(0)));
    }
    EXPECT_GT(moved, 1e-4 * player.rig.rest_diagonal) << clip.id;
    EXPECT_LT(moved, 2 * player.rig.rest_diagonal) << clip.id;
  }
}

TEST(RigExamples, Hello) { ExpectRestsAndPlays(SourceFile("scenes/hello/hello.yaml")); }

TEST(RigExamples, Face) { ExpectRestsAndPlays(SourceFile("scenes/face/face.yaml")); }

TEST(RigExamples, Head) {
  if (SharedFile("assets/head.glb").empty()) GTEST_SKIP() << "no assets beside the checkout";
  ExpectRestsAndPlays(SourceFile("tests/rigs/head_example/head.yaml"));
}

TEST(RigExamples, HeadHandlesMoveWhatTheyShould) {
  if (SharedFile("assets/head.glb").empty()) GTEST_SKIP() << "no assets beside the checkout";
  RigOptions options;
  options.rest = true;
  Player player(SourceFile("tests/rigs/head_example/head.yaml"), options);
  ASSERT_NE(player.evaluator, nullptr);
  constexpr Index kUpperLip = 466, kLowerLip = 496, kChin = 1628, kCrown = 1466;
  const std::vector<Double3> rest = player.Points();
  const auto moved = [&](Index vertex) { return Length(player.Vertex(player.Points(), vertex) - player.Vertex(rest, vertex)); };

  player.Set("lipUp.translateZ", 0.003);
  EXPECT_GT(moved(kUpperLip), 0.001);
  EXPECT_LT(moved(kLowerLip), 0.0005);
  EXPECT_LT(moved(kChin), 1e-5);
  player.Set("lipUp.translateZ", 0);
  player.Set("lipLow.translateY", -0.003);
  EXPECT_GT(moved(kLowerLip), 0.001);
  EXPECT_LT(moved(kUpperLip), 0.0005);
  player.Set("lipLow.translateY", 0);
  EXPECT_LT(MaxDistance(player.Points(), rest), 1e-7);

  player.Set("jaw.rotateX", -0.4);
  EXPECT_GT(moved(kChin), 0.02);
  EXPECT_LT(moved(kCrown), 0.001);
  player.Set("jaw.rotateX", 0);

  // Handles below the head follow it: turning it moves everything rigidly, and no wire acts
  player.Set("head.rotateY", 0.3);
  const std::vector<Double3> turned = player.Points();
  EXPECT_NEAR(Length(player.Vertex(turned, kUpperLip) - player.Vertex(turned, kLowerLip)),
              Length(player.Vertex(rest, kUpperLip) - player.Vertex(rest, kLowerLip)), 1e-4);
  EXPECT_GT(moved(kUpperLip), 0.01);
}

}  // namespace
}  // namespace kpsa
