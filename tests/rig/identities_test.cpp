// What deformers may not change, and what they must do exactly, on real characters through rig files.
#include <cmath>
#include <limits>
#include <map>
#include <tuple>

#include "base/scalar_math.h"
#include "tests/rig/rig_player.h"
#include "tests/support/shared_files.h"

namespace kpsa::engine {
namespace {

class RigIdentities : public ::testing::Test {
 protected:
  // The rig file of `text` on a shared character; "" where that is absent.
  std::string Write(const std::string& character, const std::string& text) const {
    return folder.Write("t.yaml", "kpsa: 1\ncharacter: " + SharedFile("assets/" + character) + "\n" + text);
  }
  static RigOptions Clip(const std::string& name) {
    RigOptions options;
    options.clip = name;
    return options;
  }
  static RigOptions Rest() {
    RigOptions options;
    options.rest = true;
    return options;
  }
  TemporaryFolder folder;
};

bool Absent(const std::string& character) { return SharedFile("assets/" + character).empty(); }
#define KPSA_NEEDS(character) \
  if (Absent(character)) GTEST_SKIP() << "no assets beside the checkout"

bool SameBits(const std::vector<Double3>& a, const std::vector<Double3>& b) { return a == b; }

std::vector<Double3> Moved(const Matrix4& m, std::vector<Double3> points) {
  for (Double3& p : points) p = TransformPoint(m, p);
  return points;
}

double Spacing(double at) {  // of floats
  return std::nextafter(static_cast<float>(at), std::numeric_limits<float>::infinity()) -
         static_cast<float>(at);
}

const std::string kRobotMeshes =
    "[Arm.L, Arm.R, Foot.L, Foot.R, Hand.L, Hand.R, Head, Leg.L, Leg.R, LowerLeg.L, LowerLeg.R, Shoulder.L, "
    "Shoulder.R, Torso]";

TEST_F(RigIdentities, MushWithoutIterationsIsTheIdentity) {
  KPSA_NEEDS("robot.glb");
  const std::vector<std::tuple<std::string, std::string, std::string>> cases = {
      {"Fox.glb", "[fox]", "Run"},
      {"robot.glb", kRobotMeshes, "Robot_Dance"},
      {"human.glb", "[body]", "body_move"}};
  for (const auto& [character, meshes, clip] : cases) {
    RigPlayer player(Write(character, "nodes: {mush: {type: deltaMush, iterations: 0}}\ndeform: [{meshes: " +
                                          meshes + ", stack: [gltf, mush]}]\n"),
                     Clip(clip));
    ASSERT_TRUE(player.ok());
    for (double time : {0.0, 0.31, 0.6}) {
      player.Set("time.time", time);
      for (std::size_t m = 0; m < player.rig.scene.meshes.size(); ++m)
        EXPECT_TRUE(SameBits(player.Points(m), player.Points("skin", m))) << character << m;
    }
  }
}

TEST_F(RigIdentities, MushAtRestIsTheIdentity) {
  KPSA_NEEDS("robot.glb");
  const std::vector<std::tuple<std::string, std::string>> cases = {{"Fox.glb", "[fox]"},
                                                                   {"robot.glb", kRobotMeshes},
                                                                   {"human.glb", "[body]"},
                                                                   {"rigged_simple.gltf", "[Cylinder]"},
                                                                   {"MorphStressTest.gltf", "[Main]"}};
  for (const auto& [character, meshes] : cases) {
    RigPlayer player(
        Write(character, "nodes: {mush: {type: deltaMush, pinBorderVertices: off}}\ndeform: [{meshes: " +
                             meshes + ", stack: [gltf, mush]}]\n"),
        Rest());
    ASSERT_TRUE(player.ok());
    for (std::size_t m = 0; m < player.rig.scene.meshes.size(); ++m) {
      EXPECT_LT(MaxDistance(player.Points(m), player.Points("gltf", m)), 1e-6 * player.rig.rest_diagonal)
          << character << m;
    }
  }
}

// The detail grows with the character: at rest the mush stays the identity.
TEST_F(RigIdentities, MushOfAScaledCharacterIsTheIdentityAtRest) {
  KPSA_NEEDS("head.glb");
  RigPlayer player(Write("head.glb",
                         "nodes: {mush: {type: deltaMush}}\n"
                         "deform: [{meshes: [head_mesh], stack: [gltf, mush]}]\n"
                         "controls: {root.scaleX: {min: 0.1, max: 3}, root.scaleY: {min: 0.1, max: 3}, "
                         "root.scaleZ: {min: 0.1, max: 3}}\n"));
  ASSERT_TRUE(player.ok());
  for (const char* axis : {"root.scaleX", "root.scaleY", "root.scaleZ"}) player.Set(axis, 2);
  EXPECT_LT(MaxDistance(player.Points(), player.Points("skin")), 2e-6);
}

TEST_F(RigIdentities, MushCommutesWithRigidMotion) {
  KPSA_NEEDS("human.glb");
  const std::string rig = R"(nodes: {mush: {type: deltaMush}}
deform: [{meshes: [body], stack: [gltf, mush]}]
controls:
  root.rotateY: {min: -180, max: 180}
  root.rotateX: {min: -180, max: 180}
  root.translateX: {min: -10, max: 10}
  root.translateZ: {min: -10, max: 10}
)";
  RigPlayer player(Write("human.glb", rig), Clip("body_move"));
  ASSERT_TRUE(player.ok());
  player.Set("time.time", 2.2);
  const std::vector<Double3> before = player.Points(), skinned = player.Points("skin");
  EXPECT_GT(MaxDistance(before, skinned), 0.002);  // it does something
  const Matrix4 root_before = player.World("root");
  player.Set("root.rotateY", 1.2);
  player.Set("root.rotateX", -2.5);
  player.Set("root.translateX", 1.5);
  player.Set("root.translateZ", -2);
  const Matrix4 motion = player.World("root") * InverseOrIdentity(root_before);
  EXPECT_LT(MaxDistance(player.Points("skin"), Moved(motion, skinned)), 2e-6);
  EXPECT_LT(MaxDistance(player.Points(), Moved(motion, before)), 4e-6);
}

constexpr Double3 kLow{-0.8, 1.3, -0.4}, kHigh{0.8, 1.7, 0.5};
const std::string kCage =
    "cage: {type: lattice, divisions: [2, 2, 2], outside: all, boxMin: [-0.8, 1.3, -0.4], boxMax: [0.8, 1.7, "
    "0.5]";

// The 8 controls, moved by `offset` and sheared: x += shear * y.
std::string Controls(Double3 offset, double shear) {
  std::string text = "points: [";
  for (int u = 0; u < 2; ++u) {
    for (int t = 0; t < 2; ++t) {
      for (int s = 0; s < 2; ++s)
        text += fmt::format("[{}, {}, {}], ", s + offset.x + shear * t, t + offset.y, u + offset.z);
    }
  }
  return text + "]";
}

TEST_F(RigIdentities, LatticeIsAffineWhereItsControlsAre) {
  KPSA_NEEDS("human.glb");
  const std::string deform = "deform: [{meshes: [body], stack: [gltf, cage]}]\n";
  const Double3 size = kHigh - kLow;
  for (double shear : {0.0, 0.75}) {
    const Double3 offset{0.125, -0.25, 0.5};
    RigPlayer player(
        Write("human.glb", "nodes:\n  " + kCage + ", " + Controls(offset, shear) + "}\n" + deform), Rest());
    ASSERT_TRUE(player.ok());
    const std::vector<Double3> skinned = player.Points("skin"), moved = player.Points();
    std::size_t inside = 0;
    double worst = 0;
    for (std::size_t i = 0; i < moved.size(); ++i) {
      const Double3 q{(skinned[i].x - kLow.x) / size.x, (skinned[i].y - kLow.y) / size.y,
                      (skinned[i].z - kLow.z) / size.z};
      const bool is_inside = q.x >= 0 && q.x <= 1 && q.y >= 0 && q.y <= 1 && q.z >= 0 && q.z <= 1;
      inside += is_inside;
      const double t = std::clamp(q.y, 0.0, 1.0);  // outside the nearest point of the box tells
      const Double3 expected =
          skinned[i] + Double3{size.x * (offset.x + shear * t), size.y * offset.y, size.z * offset.z};
      worst = std::max(worst, Length(moved[i] - expected));
    }
    EXPECT_GT(inside, 1000u);
    EXPECT_LT(worst, 1e-6);
  }
}

TEST_F(RigIdentities, LatticeTurnsWithItsParent) {
  KPSA_NEEDS("human.glb");
  const Double3 size = kHigh - kLow, offset{0.125, -0.25, 0.5};
  RigPlayer player(Write("human.glb", "nodes:\n  turner: {type: transform, at: [1, 2, 3]}\n  " + kCage +
                                          ", parent: turner, " + Controls(offset, 0) +
                                          "}\ndeform: [{meshes: [body], stack: [gltf, cage]}]\ncontrols:\n"
                                          "  turner.rotateX: {min: -360, max: 360}\n  turner.rotateZ: {min: "
                                          "-360, max: 360}\n  turner.translateX: {min: -9, max: 9}\n"),
                   Clip("body_move"));
  ASSERT_TRUE(player.ok());
  player.Set("time.time", 3);
  for (const auto& [x, z, along] :
       {std::tuple{0.0, 0.0, 0.0}, std::tuple{0.7, -2.0, 0.0}, std::tuple{3.1, 1.0, 5.0}}) {
    player.Set("turner.rotateX", x);
    player.Set("turner.rotateZ", z);
    player.Set("turner.translateX", along);
    // The base goes with the cage: only the controls' offsets act, in the turned axes
    const Matrix4 turn = RotationFromEuler({x, 0, z}, RotateOrder::kXyz);
    const Double3 delta = TransformVector(turn, {size.x * offset.x, size.y * offset.y, size.z * offset.z});
    EXPECT_LT(MaxDistance(player.Points(), Moved(Translation(delta), player.Points("skin"))), 1e-6);
  }
}

// Vertices that are one place of the surface in the file stay one place bit for bit, whatever their copies.
void ExpectSeamsStayClosed(RigPlayer* player, double duration) {
  const gltf::Character& character = *player->rig.character;
  std::size_t copies = 0, points = 0;
  for (std::size_t m = 0; m < player->rig.scene.meshes.size(); ++m) {
    const CharacterMesh& mesh = player->rig.scene.meshes[m];
    const gltf::Mesh& from = character.meshes[character.nodes[mesh.gltf_node].mesh];
    using Key = std::pair<std::vector<float>, std::vector<std::pair<Index, float>>>;
    std::map<Key, std::vector<Index>> places;
    for (Index v = 0; v < from.vertex_count(); ++v) {
      std::vector<std::pair<Index, float>> influences;
      for (Index i = from.influence_offsets[v]; i < from.influence_offsets[v + 1]; ++i) {
        influences.emplace_back(from.influences[i].joint, from.influences[i].weight);
      }
      std::sort(influences.begin(), influences.end());
      places[{{from.positions[3 * v] + 0.0f, from.positions[3 * v + 1] + 0.0f,
               from.positions[3 * v + 2] + 0.0f},
              influences}]
          .push_back(v);
    }
    points += places.size();
    for (double at : {0.0, 0.3, 0.62, 1.0}) {
      player->Set("time.time", at * duration);
      const std::vector<Double3> result = player->Points(m);
      double open = 0;
      for (const auto& [key, vertices] : places) {
        for (Index v : vertices) {
          copies += v != vertices[0];
          open =
              std::max(open, Length(result[player->PointOf(v, m)] - result[player->PointOf(vertices[0], m)]));
        }
      }
      EXPECT_EQ(open, 0) << mesh.name;
    }
  }
  EXPECT_GT(copies, points);  // there are seams
}

TEST_F(RigIdentities, SeamsStayClosed) {
  KPSA_NEEDS("Fox.glb");
  const std::string nodes = "nodes: {mush: {type: deltaMush, iterations: 8, pinBorderVertices: off}}\n";
  RigPlayer fox(Write("Fox.glb", nodes + "deform: [{meshes: [fox], stack: [gltf, mush]}]\n"), Clip("Run"));
  ASSERT_TRUE(fox.ok());
  ExpectSeamsStayClosed(&fox, 1.15);
  RigPlayer robot(
      Write("robot.glb", nodes + "deform: [{meshes: " + kRobotMeshes + ", stack: [gltf, mush]}]\n"),
      Clip("Robot_Dance"));
  ASSERT_TRUE(robot.ok());
  ExpectSeamsStayClosed(&robot, 3.3);
}

TEST_F(RigIdentities, ALatticeAfterTheSkinGoesWithItsParent) {
  KPSA_NEEDS("human.glb");
  RigPlayer player(Write("human.glb", R"(units: {length: cm}
nodes:
  cage: {type: lattice, parent: head, divisions: [3, 3, 3], members: {joint: head, above: 0.5}}
deform: [{meshes: [body], stack: [gltf, cage]}]
overrides: {"cage.points[1,1,2].z": 1.4, "cage.points[1,2,1].y": 1.25, "cage.points[0,1,1].x": -0.3}
)"),
                   Clip("body_move"));
  ASSERT_TRUE(player.ok());
  std::vector<Double3> first;  // what the lattice does, in the head's axes
  double turned = 0;
  Matrix4 head_first;
  for (double time : {0.0, 0.7, 1.9, 3.4, 5.6}) {
    player.Set("time.time", time);
    const std::vector<Double3> skinned = player.Points("skin"), result = player.Points();
    const Matrix4 head = player.World("head"), to_head = InverseOrIdentity(head);
    std::vector<Double3> moves;
    double most = 0;
    for (std::size_t i = 0; i < result.size(); ++i) {
      moves.push_back(TransformVector(to_head, result[i] - skinned[i]));
      most = std::max(most, Length(moves.back()));
    }
    EXPECT_GT(most, 0.01);
    if (first.empty()) {
      first = moves;
      head_first = head;
    }
    turned =
        std::max(turned, Length(TransformVector(head, {1, 0, 0}) - TransformVector(head_first, {1, 0, 0})));
    EXPECT_LT(MaxDistance(moves, first), 1e-6) << time;
  }
  EXPECT_GT(turned, 0.05);  // the head does turn in this clip
}

// The shape of a character does not depend on where it stands, up to the spacing of floats there.
TEST_F(RigIdentities, ACharacterFarFromTheOriginKeepsItsShape) {
  KPSA_NEEDS("human.glb");
  RigPlayer player(Write("human.glb", R"(units: {length: cm}
nodes:
  nose: {type: transform, parent: head, at: [0, 148, 12], translate: [0, 1, 2], rotateX: 20}
  hand: {type: transform, parent: wrist.L, at: wrist.L, rotateY: 30}
  brow: {type: curve, vertices: [150, 151, 152], parent: head}
  wire: {type: wire, curve: brow, dropoff: 4, parent: head}
  cage: {type: lattice, parent: head, divisions: [3, 3, 3], members: {joint: head, above: 0.1}}
  soft: {type: softMod, matrix: nose.worldMatrix, parent: head, falloffRadius: 8}
  grip: {type: cluster, matrix: hand.worldMatrix, parent: wrist.L, falloff: {at: wrist.L, radius: 12}}
  mush: {type: deltaMush}
deform: [{meshes: [body], stack: [gltf, wire, cage, soft, grip, mush]}]
overrides: {"cage.points[1,1,2].z": 1.4, "brow.cv[1].y": 1.5}
controls:
  root.translateX: {min: -100000, max: 100000}
  root.translateY: {min: -100000, max: 100000}
  nose.translateZ: {min: 0, max: 2}
  hand.rotateY: {min: -90, max: 90}
)"),
                   Clip("body_move"));
  ASSERT_TRUE(player.ok());
  const std::vector<std::string> stages = {"skin", "wire", "cage", "soft", "grip", "mush"};
  const double spacing = Spacing(1000);  // 6.1e-5 m
  player.Set("nose.translateZ", 0.02);
  player.Set("hand.rotateY", 0.5);
  for (double time : {0.4, 3.0}) {
    player.Set("time.time", time);
    player.Set("root.translateX", 0);
    player.Set("root.translateY", 0);
    std::vector<std::vector<Double3>> near;
    for (const std::string& stage : stages) near.push_back(player.Points(stage));
    const Matrix4 root = player.World("root");
    player.Set("root.translateX", 1000);
    player.Set("root.translateY", -600);
    const Matrix4 motion = player.World("root") * InverseOrIdentity(root);
    for (std::size_t i = 0; i < stages.size(); ++i) {
      const double worst = MaxDistance(player.Points(stages[i]), Moved(motion, near[i]));
      EXPECT_LT(worst, 2 * spacing) << stages[i] << " at " << time;
    }
  }
}

// A point is skinned to the same bits alone as among all, also where its joints are not those of the others.
TEST_F(RigIdentities, SkinDoesNotDependOnWhichPointsAreWanted) {
  folder.Write("c.gltf", GltfBuilder::Character().Text());
  Result<Rig> rig = LoadRig(StandardRegistry(), folder.Write("t.yaml", R"(kpsa: 1
character: c.gltf
overrides: {root.translateX: 0.37, root.translateY: 1000.1, root.translateZ: 3.3, root.rotate: [10, 20, 30], tip.rotate: [41, 7, 3]}
)"),
                            Rest());
  ASSERT_TRUE(rig.ok()) << rig.status().ToString();
  const CharacterMesh& mesh = rig->scene.meshes[0];
  Compiler compiler;
  const auto points = [&](const PointSet& set) {
    Request request;
    request.varying = {
        *rig->graph->FindPlug("root.translateX")};  // what does not vary is folded for all points
    request.outputs.push_back({mesh.points, set});
    Result<std::shared_ptr<const Plan>> plan = compiler.Compile(*rig->graph, request);
    EXPECT_TRUE(plan.ok()) << plan.status().ToString();
    Evaluator evaluator(*plan);
    EXPECT_TRUE(evaluator.Evaluate().ok());
    const ConstPointsView view = evaluator.Points(0);
    std::vector<Double3> result;
    for (std::size_t i = 0; i < view.count; ++i) result.push_back({view.x[i], view.y[i], view.z[i]});
    return result;
  };
  const std::vector<Double3> all = points({});
  ASSERT_EQ(all.size(), 3u);
  for (Index p = 0; p < 3; ++p) EXPECT_EQ(points(PointSet::Of({p}, 3)), std::vector<Double3>{all[p]}) << p;
}

}  // namespace
}  // namespace kpsa::engine
