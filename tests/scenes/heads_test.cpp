// The heads with a production's rig: the boy and the animal.
#include "tests/scenes/heads.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>

#include "scenes/face_model.h"
#include "tests/scenes/mesh_checks.h"

namespace kpsa::engine::scenes {
namespace {

struct Made {
  const HeadDesign& design;
  double asked;  // points
  const HeadShape& shape = ShapeOf(design);
  std::vector<Expression> expressions = FaceExpressions(design, shape);
};
const std::vector<Made>& Heads() {
  static const std::vector<Made> heads = [] {
    std::vector<Made> made;
    made.push_back({BoyDesign(), 2986});
    made.push_back({AnimalDesign(), 4150});
    return made;
  }();
  return heads;
}

TEST(Heads, HaveTheReferencesNumbersOfPointsWithinTwoPercent) {
  for (const Made& head : Heads())
    EXPECT_NEAR(static_cast<double>(head.shape.points.size()), head.asked, 0.02 * head.asked)
        << head.design.name;
}

TEST(Heads, AreSymmetricToTheBit) {
  for (const Made& head : Heads()) {
    for (std::size_t i = 0; i < head.shape.points.size(); ++i) {
      const Double3 p = head.shape.points[i],
                    m = head.shape.points[static_cast<std::size_t>(head.shape.mirror[i])];
      EXPECT_EQ(p, (Double3{-m.x, m.y, m.z})) << head.design.name << " " << i;
    }
  }
}

// Three borders: the neck and the sockets.
TEST(Heads, AreManifoldsWithThreeBordersAndNoFlatTriangles) {
  for (const Made& head : Heads()) {
    EXPECT_EQ(CountBorders(head.shape.quads, head.design.name), 3) << head.design.name;
    CheckPointsAndTriangles(head.shape.points, head.shape.quads, 1e-6, head.design.name);
  }
}

// What makes them other heads than the reference, in shares of the height of the head.
TEST(Heads, DifferInTheirProportions) {
  const HeadDesign &face = FaceDesign(), &boy = BoyDesign(), &animal = AnimalDesign();
  EXPECT_GT(boy.eye_radius, 1.3 * face.eye_radius);
  EXPECT_LT(boy.mouth_half_width, 0.9 * face.mouth_half_width);
  // The muzzle: the mouth is far in front of the eyes, and the tip of the nose is wide
  EXPECT_GT(animal.mouth_center.z - animal.eye_center.z, 2 * (face.mouth_center.z - face.eye_center.z));
  EXPECT_GT(face.distance({1.2, 15.2, 10.9}), 0);
  EXPECT_LT(animal.distance({1.2, 13.05, 12.2}), 0);
  // Ears: beside the boy's head, above the animal's
  for (const Made& head : Heads()) {
    double highest = 0, ear = 0;
    for (std::size_t i = 0; i < head.shape.points.size(); ++i)
      (head.shape.ear[i] > 0 ? ear : highest) =
          std::max(head.shape.ear[i] > 0 ? ear : highest, head.shape.points[i].y);
    EXPECT_EQ(ear > highest + 3, head.design.ear.pointed) << head.design.name;
  }
}

TEST(Heads, EveryExpressionMovesSomethingAndCorrectivesComeLast) {
  for (const Made& head : Heads()) {
    std::map<std::string, std::size_t> names;
    std::size_t correctives = 0;
    for (const Expression& e : head.expressions) {
      EXPECT_TRUE(names.emplace(e.name, names.size()).second) << e.name;
      EXPECT_TRUE(IsCorrective(e.name) || correctives == 0) << e.name;
      correctives += IsCorrective(e.name);
      std::size_t moved = 0;
      double largest = 0;
      for (const Double3& d : e.deltas) moved += Length(d) > 2e-4, largest = std::max(largest, Length(d));
      EXPECT_GT(moved, 15u) << head.design.name << " " << e.name;
      EXPECT_GT(largest, 0.05) << head.design.name << " " << e.name;
      EXPECT_LT(largest, 2.5) << head.design.name << " " << e.name;
    }
    EXPECT_GE(head.expressions.size() - correctives, 40u);
    EXPECT_GE(correctives, 20u);
    for (const char* name : {"blink_half.L", "mouthOpen_half", "smile_and_mouthOpen.R", "smile_and_blink.L"})
      EXPECT_TRUE(names.contains(name)) << name;
  }
}

TEST(Heads, ABlinkClosesTheEyeAroundTheEyeball) {
  for (const Made& head : Heads()) {
    const auto find = [&](const char* name) {
      for (const Expression& e : head.expressions) {
        if (e.name == name) return &e;
      }
      return static_cast<const Expression*>(nullptr);
    };
    const Expression *full = find("blink.L"), *half = find("blink_half.L");
    ASSERT_TRUE(full != nullptr && half != nullptr);
    const std::vector<int>& edge = head.shape.eye_rings[static_cast<std::size_t>(head.shape.lid_ring)];
    const std::size_t n = edge.size(), top = n / 4;
    const auto at = [&](const Expression& e, std::size_t k) {
      const auto i = static_cast<std::size_t>(edge[k]);
      return head.shape.points[i] + e.deltas[i];
    };
    EXPECT_LT(Length(at(*full, top) - at(*full, n - top)), 0.2) << head.design.name;
    for (std::size_t k = 0; k < n; ++k) {
      for (const Expression* e : {full, half})
        EXPECT_GT(Length(at(*e, k) - head.design.eye_center), head.design.eye_radius)
            << head.design.name << k;
    }
  }
}

TEST(Heads, WeightsUseEveryJointAndClipsRestTheCorrectives) {
  for (const Made& head : Heads()) {
    std::set<int> used;
    for (const auto& shares : FaceWeights(head.design, head.shape)) {
      const Influences influences = MakeInfluences(std::span(shares.data(), head.design.joints.size()));
      for (std::size_t k = 0; k < 4; ++k) {
        if (influences.weights[k] > 0) used.insert(influences.joints[k]);
      }
    }
    EXPECT_EQ(used.size(), head.design.joints.size());
    std::vector<std::string> names;
    for (const Expression& e : head.expressions) names.push_back(e.name);
    std::set<std::string> clips;
    for (const GlbClip& clip : FaceClips(head.design, names, 9)) {
      clips.insert(clip.name);
      ASSERT_TRUE(clip.channels.back().weights);
      double moved = 0;
      for (std::size_t i = 0; i < clip.channels.back().values.size(); ++i) {
        const double weight = clip.channels.back().values[i];
        EXPECT_TRUE(weight >= 0 && weight <= 1 && (weight == 0 || !IsCorrective(names[i % names.size()])));
        moved += weight;
      }
      EXPECT_GT(moved, 0.3 * clip.frames) << clip.name;
    }
    EXPECT_EQ(clips, (std::set<std::string>{"extreme", "talk_train", "talk", "emotions",
                                            &head.design == &BoyDesign() ? "scene" : "sniff"}));
  }
}

TEST(Heads, SheetsLieUnderTheSkinAndPull) {
  for (const Made& head : Heads()) {
    for (const Sheet sheet : kSheets) {
      SCOPED_TRACE(head.design.name + " " + NameOf(sheet));
      const SheetShape muscles = MakeSheet(head.design, sheet);
      EXPECT_GT(muscles.points.size(), 60u);
      EXPECT_LT(muscles.points.size(), 400u);
      for (const Double3& p : muscles.points) EXPECT_LT(head.design.distance(p), -0.2);
      int pulling = 0;  // the animal's sheet of muscles does not reach its chin
      for (const Expression& pull : muscles.pulls) {
        double largest = 0;
        for (const Double3& d : pull.deltas) largest = std::max(largest, Length(d));
        pulling += largest > 0.05;
      }
      EXPECT_GE(pulling, 8);
    }
  }
}

TEST(Heads, WeightMapsAreFromZeroToOneAndUsed) {
  for (const Made& head : Heads()) {
    for (const auto& [name, values] : FaceWeightMaps(head.design, head.shape)) {
      ASSERT_EQ(values.size(), head.shape.points.size()) << name;
      double sum = 0;
      for (double v : values) {
        EXPECT_TRUE(v >= 0 && v <= 1) << name << " " << v;
        sum += v;
      }
      EXPECT_GT(sum, 10) << head.design.name << " " << name;
    }
  }
}

}  // namespace
}  // namespace kpsa::engine::scenes
