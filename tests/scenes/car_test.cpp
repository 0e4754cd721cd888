// The generated car: its shape, skin, expressions and clips.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "gltf/import.h"
#include "scenes/car_model.h"
#include "tests/scenes/mesh_checks.h"

namespace kpsa::engine::scenes::car {
namespace {

const CarShape& Shape() {
  static const CarShape shape = MakeCarShape();
  return shape;
}
const std::vector<Expression>& Shapes() {
  static const std::vector<Expression> expressions = CarExpressions(Shape());
  return expressions;
}
const Expression& Find(const std::string& name) {
  const auto it =
      std::find_if(Shapes().begin(), Shapes().end(), [&](const Expression& e) { return e.name == name; });
  EXPECT_NE(it, Shapes().end()) << name;
  return *it;
}
std::size_t At(const std::vector<int>& ring, std::size_t k) { return static_cast<std::size_t>(ring[k]); }

TEST(Car, HasTheReferencesNumberOfPointsWithinTwoPercent) {
  EXPECT_NEAR(static_cast<double>(Shape().points.size()), 2625, 0.02 * 2625);
  double low = 1e9, high = -1e9, wide = 0, front = 0;
  for (const Double3& p : Shape().points) {
    low = std::min(low, p.y), high = std::max(high, p.y), wide = std::max(wide, 2 * p.x),
    front = std::max(front, p.z);
  }
  EXPECT_NEAR(low, 20, 2);
  EXPECT_NEAR(high, 155, 8);
  EXPECT_NEAR(wide, 180, 8);
  EXPECT_NEAR(front, 182, 8);
}

TEST(Car, IsSymmetricToTheBit) {
  for (std::size_t i = 0; i < Shape().points.size(); ++i)
    EXPECT_EQ(Mirrored(Shape().points[i]), Shape().points[At(Shape().mirror, i)]);
}

// The lower edge and the two sockets.
TEST(Car, IsAManifoldWithThreeBorders) { EXPECT_EQ(CountBorders(Shape().quads, "car"), 3); }

TEST(Car, NoTwoPointsCoincideAndNoTriangleIsFlat) {
  CheckPointsAndTriangles(Shape().points, Shape().quads, 1e-3, "car");
  std::set<int> used;
  for (const auto& q : Shape().quads) used.insert(q.begin(), q.end());
  EXPECT_EQ(used.size(), Shape().points.size());
}

TEST(Car, WeightsAddUpToExactlyOneAndUseTheJointsOfTheShell) {
  std::set<int> used;
  for (const JointShares& shares : CarWeights(Shape())) {
    for (double w : shares) EXPECT_GE(w, 0);
    const Influences influences = MakeInfluences(shares);
    float sum = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      sum += influences.weights[k];
      if (influences.weights[k] > 0) used.insert(influences.joints[k]);
    }
    EXPECT_EQ(sum, 1.0f);
  }
  EXPECT_EQ(used, (std::set<int>{kChassis, kBody, kHood, kRoof, kJaw, kLidUpL, kLidUpR, kLidLowL, kLidLowR}));
}

TEST(Car, TheJawMovesTheLowerLipAndNotTheUpper) {
  const std::vector<JointShares> weights = CarWeights(Shape());
  const std::vector<int>& lips = Shape().mouth_rings[static_cast<std::size_t>(Shape().lip_ring)];
  const std::size_t quarter = lips.size() / 4;
  EXPECT_LT(weights[At(lips, quarter)][kJaw], 0.01);
  EXPECT_GT(weights[At(lips, 3 * quarter)][kJaw], 0.99);
}

TEST(Car, EveryExpressionMovesSomethingAndIsMirrored) {
  std::set<std::string> names;
  for (const Expression& e : Shapes()) {
    EXPECT_TRUE(names.insert(e.name).second) << e.name;
    std::size_t moved = 0;
    double largest = 0;
    for (const Double3& d : e.deltas) moved += Length(d) > 0.02, largest = std::max(largest, Length(d));
    EXPECT_GT(moved, 15u) << e.name;
    EXPECT_LT(moved, e.deltas.size() / 2) << e.name;
    EXPECT_GT(largest, 1) << e.name;
    EXPECT_LT(largest, 30) << e.name;
    if (!e.name.ends_with(".L")) continue;
    const Expression& right = Find(e.name.substr(0, e.name.size() - 1) + "R");
    for (std::size_t i = 0; i < e.deltas.size(); ++i)
      EXPECT_EQ(Mirrored(e.deltas[i]), right.deltas[At(Shape().mirror, i)]) << e.name;
  }
  EXPECT_GE(names.size(), 35u);
  const CarCage cage = MuscleCage();
  for (const Expression& e : MuscleExpressions(cage)) {
    EXPECT_EQ(e.deltas.size(), cage.points.size());
    EXPECT_GT(std::count_if(e.deltas.begin(), e.deltas.end(), [](Double3 d) { return Length(d) > 1; }), 2)
        << e.name;
  }
}

TEST(Car, ABlinkClosesTheEyeAroundTheEyeball) {
  const Expression &blink = Find("blink.L"), &half = Find("blinkHalf.L");
  const std::vector<int>& edge = Shape().eye_rings[static_cast<std::size_t>(Shape().lid_ring)];
  const std::size_t n = edge.size(), top = n / 4;
  const auto closed = [&](std::size_t k) { return Shape().points[At(edge, k)] + blink.deltas[At(edge, k)]; };
  const double open = Length(Shape().points[At(edge, top)] - Shape().points[At(edge, n - top)]);
  EXPECT_GT(open, 15);
  EXPECT_LT(Length(closed(top) - closed(n - top)), 0.2 * open);
  for (std::size_t k = 0; k < n; ++k) {
    for (double share : {0.25, 0.5, 0.75, 1.0}) {  // through the shape half way
      const Double3 a = half.deltas[At(edge, k)], b = blink.deltas[At(edge, k)];
      const Double3 d = share < 0.5 ? a * (2 * share) : a + (b - a) * (2 * share - 1);
      EXPECT_GT(Length(Shape().points[At(edge, k)] + d - kEye), kEyeBall) << k << " at " << share;
    }
  }
}

// No cage lies in the shell, or far away from it.
TEST(Car, TheCagesKeepOffTheShell) {
  // The two tubes run through the cabin
  const std::pair<CarCage, double> cages[] = {
      {MuscleCage(), 70}, {PanelCage(), 70}, {FrameCage(), 81}, {ClayCage(), 71}};
  for (const auto& [cage, farthest] : cages) {
    std::set<int> used;
    for (const auto& q : cage.quads) used.insert(q.begin(), q.end());
    EXPECT_EQ(used.size(), cage.points.size());
    for (const Double3& c : cage.points) {
      double nearest = 1e9;
      Double3 at;
      for (const Double3& p : Shape().points) {
        if (Length(p - c) < nearest) nearest = Length(p - c), at = p;
      }
      EXPECT_GT(nearest, 1);
      EXPECT_LT(nearest, farthest);
    }
  }
}

TEST(Car, TheFileLoadsWithItsMeshesJointsAndClips) {
  const SceneFiles files = GenerateCar();
  const std::string& glb = files.at("car.glb");
  EXPECT_LT(glb.size(), 3u << 19);
  const auto car = gltf::LoadGltfFromMemory(
      std::span(reinterpret_cast<const std::uint8_t*>(glb.data()), glb.size()), "", "car.glb");
  ASSERT_TRUE(car.ok()) << car.status().ToString();
  EXPECT_TRUE(car->warnings.empty());
  ASSERT_EQ(car->meshes.size(), 6u);
  std::size_t shown = 0;
  for (const gltf::Node& node : car->nodes) shown += node.mesh != kNoIndex && node.visible;
  EXPECT_EQ(shown, 2u);
  EXPECT_EQ(car->meshes[0].vertex_count(), Shape().points.size());
  EXPECT_EQ(car->meshes[0].targets.size(), Shapes().size());
  EXPECT_EQ(car->meshes[2].vertex_count(), MuscleCage().points.size());
  for (const gltf::Mesh& mesh : car->meshes) EXPECT_TRUE(mesh.skinned());
  for (const char* clip : {"extreme", "talk_train", "talk", "emotions", "race"})
    EXPECT_NE(car->FindClip(clip), kNoIndex) << clip;
  for (const char* name : {"body", "jaw", "lidUp.L", "wheel.BR", "car_body", "car_parts", "muscles", "panels",
                           "frame", "clay"}) {
    EXPECT_TRUE(std::any_of(car->nodes.begin(), car->nodes.end(), [&](const gltf::Node& n) {
      return n.name == name;
    })) << name;
  }
}

TEST(Car, TheClipsHaveUnitRotationsAndWeightsInRangeAndTestAndTrainingDiffer) {
  std::vector<std::string> names, muscles;
  for (const Expression& e : Shapes()) names.push_back(e.name);
  for (const Expression& e : MuscleExpressions(MuscleCage())) muscles.push_back(e.name);
  const std::vector<GlbClip> clips = CarClips(names, 16, muscles, 18);
  ASSERT_EQ(clips.size(), 5u);
  const auto controls =
      static_cast<std::size_t>(std::find(names.begin(), names.end(), "blinkHalf.L") - names.begin());
  for (const GlbClip& clip : clips) {
    std::vector<double> largest(names.size());
    for (const GlbChannel& channel : clip.channels) {
      const std::size_t width = !channel.weights ? 4 : channel.node == 16 ? names.size() : muscles.size();
      ASSERT_EQ(channel.values.size(), width * static_cast<std::size_t>(clip.frames)) << clip.name;
      for (std::size_t i = 0; i < channel.values.size(); i += channel.weights ? 1 : 4) {
        const double v = channel.values[i];
        if (channel.weights) {
          EXPECT_TRUE(v >= 0 && v <= 1);
          if (channel.node == 16) largest[i % width] = std::max(largest[i % width], v);
        } else {
          double length = 0;
          for (std::size_t k = 0; k < 4; ++k) length += double{channel.values[i + k]} * channel.values[i + k];
          EXPECT_NEAR(length, 1, 1e-6);
        }
      }
    }
    // Every control moves in every clip but those written by hand; what the rig makes of others does not
    const bool by_hand = clip.name == "emotions" || clip.name == "race";
    std::size_t moved = 0;
    for (std::size_t e = 0; e < names.size(); ++e) {
      moved += largest[e] > 0.1;
      if (!by_hand || e >= controls) {
        EXPECT_EQ(largest[e] > 0.1, e < controls) << clip.name << names[e];
      }
    }
    EXPECT_GE(moved, 15u) << clip.name;
  }
  const std::vector<float>&train = clips[1].channels.back().values, &test = clips[2].channels.back().values;
  EXPECT_FALSE(std::equal(test.begin(), test.end(), train.begin()));
}

TEST(Car, CurvesHaveNinePointsInARowAndMirrorImages) {
  EXPECT_EQ(Shape().curves.size(), 12u);
  for (const auto& [name, points] : Shape().curves) {
    ASSERT_EQ(points.size(), 9u) << name;
    EXPECT_EQ(std::set<int>(points.begin(), points.end()).size(), 9u) << name;
    if (!name.ends_with(".L")) continue;
    const std::vector<int>& right = Shape().curves.at(name.substr(0, name.size() - 1) + "R");
    for (std::size_t k = 0; k < 9; ++k) EXPECT_EQ(Shape().mirror[At(points, k)], right[k]) << name;
  }
}

}  // namespace
}  // namespace kpsa::engine::scenes::car
