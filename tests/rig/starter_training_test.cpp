// What `kpsa init` decides by itself: tolerance, clips, samples.
#include "rig/build/starter_training.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/scalar_math.h"
#include "rig/build/writer.h"
#include "tests/rig/rig_fixture.h"
#include "tests/support/moving_character.h"
#include "tests/support/shared_files.h"

namespace kpsa::engine {
namespace {

using Names = std::vector<std::string>;

TEST(StarterTolerance, IsAShareOfTheSizeOrOfTheMotionInRoundSteps) {
  EXPECT_DOUBLE_EQ(StarterTolerance(1.9, 0.2), 0.005);     // a body: its size counts
  EXPECT_DOUBLE_EQ(StarterTolerance(1.9, 0), 0.005);       // nothing moves
  EXPECT_DOUBLE_EQ(StarterTolerance(0.37, 0.003), 0.001);  // a face: 30 % of what little it moves
  EXPECT_DOUBLE_EQ(StarterTolerance(180, 20), 0.5);        // in other units
  EXPECT_DOUBLE_EQ(StarterTolerance(1, 1), 0.002);
  EXPECT_GT(StarterTolerance(0, 0), 0);
  EXPECT_GT(StarterTolerance(1e-30, 1e-30), 0);
  for (double size = 0.01; size < 1000; size *= 1.07) {
    const double tolerance = StarterTolerance(size, 0);
    EXPECT_NEAR(std::log10(tolerance / size), std::log10(kToleranceOfSize), 0.2)
        << size;  // no step is farther
    const double power = std::pow(10.0, std::floor(std::log10(tolerance * 1.0001)));
    const double digit = std::round(tolerance / power);
    EXPECT_TRUE(digit == 1 || digit == 2 || digit == 5) << tolerance;
    EXPECT_NEAR(digit, tolerance / power, 1e-9);
  }
}

TEST(StarterSamples, GrowWithControlsWithinBounds) {
  EXPECT_EQ(StarterSamples(2, 0), 400);
  EXPECT_GT(StarterSamples(150, 700), 800);
  EXPECT_GT(StarterSamples(300, 700), StarterSamples(150, 700));
  // Every control is trained at its ends besides: all poses together are bounded
  for (const std::size_t controls : {2u, 50u, 400u, 1000u, 1800u}) {
    for (const std::int64_t frames : {0, 500}) {
      EXPECT_LE(StarterSamples(controls, frames) + 2 * static_cast<int>(controls) + frames, 4700) << controls;
    }
  }
  EXPECT_EQ(StarterSamples(2000, 1'000'000), 400);
}

// Poses of one point that is at x(frame).
template <typename F>
PointPoses PosesOf(std::int64_t frames, const F& x) {
  PointPoses poses;
  poses.points = 1;
  for (std::int64_t f = 0; f < frames; ++f) {
    poses.times.push_back(static_cast<double>(f) / kUnsaidFps);
    poses.rows.insert(poses.rows.end(), {static_cast<float>(x(f)), 0, 0});
  }
  return poses;
}

TEST(CutClip, PartsAlternateWithGaps) {
  for (const std::int64_t frames : {24, 49, 73, 150, 400, 1000, 5000}) {
    SCOPED_TRACE(frames);
    const PointPoses poses =
        PosesOf(frames, [](std::int64_t f) { return std::sin(0.4 * static_cast<double>(f)); });
    const std::vector<ClipPart> parts = CutClip(poses, frames);
    ASSERT_GE(parts.size(), 3u);
    std::int64_t tested = 0, trained = 0;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      EXPECT_EQ(parts[i].test, i % 2 == 1);
      EXPECT_LT(parts[i].first, parts[i].last);
      (parts[i].test ? tested : trained) += parts[i].last - parts[i].first + 1;
      // Half a second of what is long enough
      if (i > 0) {
        EXPECT_GT(parts[i].first - parts[i - 1].last, std::min<std::int64_t>(11, frames / 25));
      }
    }
    EXPECT_EQ(parts.front().first, 0);
    EXPECT_EQ(parts.back().last, frames - 1);
    EXPECT_NEAR(static_cast<double>(tested), 0.25 * static_cast<double>(frames), 5);
    EXPECT_GT(trained, tested);
  }
  EXPECT_TRUE(CutClip(PosesOf(23, [](std::int64_t f) { return static_cast<double>(f); }), 23).empty());
}

TEST(CutClip, TestsWhereThePointsMove) {
  // Everything rests in the middle and at the beginning
  const auto late = [](std::int64_t f) { return f < 62 ? 0 : std::sin(0.4 * static_cast<double>(f)); };
  for (const ClipPart& part : CutClip(PosesOf(100, late), 100)) {
    if (part.test) {
      EXPECT_GT(part.last, 66);
    }
  }
  // The wildest part is left to training
  const auto wild = [](std::int64_t f) {
    return std::sin(0.4 * static_cast<double>(f)) * (f > 45 && f < 62 ? 3 : 1.8);
  };
  for (const ClipPart& part : CutClip(PosesOf(100, wild), 100)) {
    if (part.test) {
      EXPECT_TRUE(part.last <= 50 || part.first >= 50) << part.first;
    }
  }
}

class StarterTrainingTest : public RigFixture {
 protected:
  // The starter rig of the character, and that rig loaded.
  std::string Starter(const MovingCharacter& character, std::string* remark = nullptr) {
    folder.Write("m.gltf", character.builder.Text());
    const Result<std::string> text = StarterRig(StandardRegistry(), folder / "m.gltf", {}, remark);
    EXPECT_TRUE(text.ok()) << text.status().ToString();
    return text.ok() ? *text : "";
  }
  Rig Reload(const std::string& text) {
    Result<Rig> rig = LoadRig(StandardRegistry(), folder.Write("m.yaml", text));
    EXPECT_TRUE(rig.ok()) << rig.status().ToString() << text;
    return rig.ok() ? std::move(*rig) : Rig();
  }
};

TEST_F(StarterTrainingTest, OneClipIsCutInTime) {
  MovingCharacter character;
  character.Swing("dance", 40, 10);
  const std::string text = Starter(character);
  const Rig rig = Reload(text);
  ASSERT_EQ(rig.accelerate.size(), 1u) << text;
  EXPECT_EQ(rig.accelerate[0].test_clips, (Names{"dance_test1", "dance_test2"}));
  EXPECT_EQ(rig.accelerate[0].train_clips, (Names{"dance_train1", "dance_train2", "dance_train3"}));
  EXPECT_TRUE(Has(text, "# dance alone moves the points")) << text;
}

// The parts have names of their own.
TEST_F(StarterTrainingTest, PartsTakeNoNameOfAClip) {
  MovingCharacter character;
  character.Swing("dance", 40, 3);
  character.Animate("dance_test1", 2, "rotation", {0}, {0, 0, 0, 1});
  const Rig rig = Reload(Starter(character));
  ASSERT_EQ(rig.accelerate.size(), 1u);
  EXPECT_EQ(rig.accelerate[0].test_clips, Names{"dance_test2"});
}

TEST_F(StarterTrainingTest, TheTestClipMoves) {
  MovingCharacter character;
  character.Animate("rest", 2, "rotation", {0, 2}, {0, 0, 0, 1, 0, 0, 0, 1});
  character.Animate("pose", 2, "rotation", {0}, {0, 0, 0.6f, 0.8f});
  character.Animate("held", 2, "rotation", {0, 2}, {0, 0, 0.6f, 0.8f, 0, 0, 0.6f, 0.8f});
  character.Swing("breath", 0.2, 2);  // what hardly moves is no test, but trains
  character.Swing("wild", 60, 2);
  character.Swing("tame", 30, 2);
  const std::string text = Starter(character);
  const Rig rig = Reload(text);
  ASSERT_EQ(rig.accelerate.size(), 1u) << text;
  EXPECT_EQ(rig.accelerate[0].test_clips, Names{"tame"}) << text;
  EXPECT_EQ(rig.accelerate[0].train_clips, (Names{"breath", "wild"})) << text;
  EXPECT_TRUE(Has(text, "# Clips that move no point, and train nothing: rest, pose, held")) << text;
  EXPECT_FALSE(Has(text, "\nclips:")) << text;
}

// Clips that travel as a whole train, since the guards know their motion then; the one that deforms is cut.
TEST_F(StarterTrainingTest, TravelIsNoMotionOfItsSpace) {
  MovingCharacter character;
  character.Animate("travel", 1, "translation", {0, 2}, {0, 0, 0, 5, 0, 0});
  character.Swing("dance", 40, 3);
  const Rig rig = Reload(Starter(character));
  ASSERT_EQ(rig.accelerate.size(), 1u);
  EXPECT_EQ(rig.graph->name(*rig.accelerate[0].space), "root");
  EXPECT_EQ(rig.accelerate[0].train_clips, (Names{"travel", "dance_train1", "dance_train2"}));
  EXPECT_EQ(rig.accelerate[0].test_clips, Names{"dance_test1"});
}

// A clip of less than a second is not cut: controls alone train it.
TEST_F(StarterTrainingTest, AShortClipTests) {
  MovingCharacter character;
  character.Swing("step", 40, 0.75);
  const std::string text = Starter(character);
  const Rig rig = Reload(text);
  ASSERT_EQ(rig.accelerate.size(), 1u);
  EXPECT_EQ(rig.accelerate[0].test_clips, Names{"step"});
  EXPECT_TRUE(rig.accelerate[0].train_clips.empty());
  EXPECT_TRUE(Has(text, "the only one that moves the points, and short")) << text;
}

TEST_F(StarterTrainingTest, TheToleranceSaysWhereItIsFrom) {
  MovingCharacter character;
  character.Swing("dance", 40, 3);
  EXPECT_TRUE(Has(Starter(character),
                  "    tolerance: 2mm  # the largest error of a point that is accepted: 0.3 % "
                  "of the size (1.01m)"));
  MovingCharacter timid;  // 1 degree moves half a metre's end by 9 mm
  timid.Swing("dance", 1, 3);
  const std::string text = Starter(timid);
  EXPECT_TRUE(Has(text, "    tolerance: 2mm")) << text;
  EXPECT_TRUE(Has(text, "30 % of how far the clips move what moves most (RMS ")) << text;
}

// A spline leaves its keys in between: the range is that of the clip.
TEST_F(StarterTrainingTest, RangesAreThoseBetweenKeys) {
  MovingCharacter character;  // its keys rest; tangents of 1 m/s lead up at first, then below
  character.Animate("spline", 2, "translation", {0, 2},
                    {0, 0, 0, 0.5f, 0, 0, 0, 1, 0, /**/ 0, 1, 0, 0.5f, 0, 0, 0, 0, 0}, "CUBICSPLINE");
  const std::string text = Starter(character);
  const Rig rig = Reload(text);
  ASSERT_EQ(rig.controls.size(), 1u) << text;
  EXPECT_EQ(rig.controls[0].name, "tip.translateY");
  double low = 0, high = 0;
  for (double t = 0; t <= 1; t += 0.001) {
    const double y = 2 * (t * t * t - 2 * t * t + t) + 2 * (t * t * t - t * t);
    low = std::min(low, y), high = std::max(high, y);
  }
  EXPECT_GT(high, 0.15);
  EXPECT_LE(rig.controls[0].min, low + 1e-3);
  EXPECT_GE(rig.controls[0].max, high - 1e-3);
  EXPECT_NEAR(rig.controls[0].max, high, 0.02);
  EXPECT_NEAR(rig.controls[0].min, low, 0.02);
}

// An elbow that bends by 130 degrees about Y: within a turn, angles of X, Y and Z would be 180, 50 and 180.
TEST_F(StarterTrainingTest, RangesFollowABendBeyondARightAngle) {
  MovingCharacter character;
  std::vector<float> times, turns;
  for (int k = 0; k <= 48; ++k) {
    const double angle = -65 * kPi / 180 * (1 - std::cos(k * 0.25)) / 2;  // half of it
    times.push_back(static_cast<float>(k) / 24);
    turns.insert(turns.end(),
                 {0, static_cast<float>(std::sin(angle)), 0, static_cast<float>(std::cos(angle))});
  }
  character.Animate("bend", 2, "rotation", times, turns);
  const std::string text = Starter(character);
  const Rig rig = Reload(text);
  ASSERT_EQ(rig.controls.size(), 1u) << text;
  EXPECT_EQ(rig.controls[0].name, "tip.rotateY");
  EXPECT_NEAR(rig.controls[0].min, -130 * kPi / 180, 0.02);
  EXPECT_EQ(rig.controls[0].max, 0);
}

// Joints that are scaled are controls, and nothing below them carries the points rigidly.
TEST_F(StarterTrainingTest, GrowthIsAControlAndNoSpace) {
  MovingCharacter character;
  character.Swing("dance", 40, 3);
  EXPECT_EQ(Reload(Starter(character)).accelerate.at(0).space.has_value(), true);
  character.Animate("squash", 1, "scale", {0, 1, 2}, {1, 1, 1, 1.2f, 0.7f, 1, 1, 1.5f, 1});
  const std::string text = Starter(character);
  const Rig rig = Reload(text);
  ASSERT_EQ(rig.accelerate.size(), 1u) << text;
  EXPECT_FALSE(rig.accelerate[0].space.has_value()) << text;
  const auto range = [&](const std::string& name) {
    for (const Control& control : rig.controls) {
      if (control.name == name) return std::pair(control.min, control.max);
    }
    return std::pair(-1.0, -1.0);
  };
  EXPECT_NEAR(range("root.scaleX").first, 1, 1e-9) << text;
  EXPECT_NEAR(range("root.scaleX").second, 1.2, 0.011);  // rounded outwards
  EXPECT_NEAR(range("root.scaleY").first, 0.7, 0.011);
  EXPECT_NEAR(range("root.scaleY").second, 1.5, 0.011);
  EXPECT_EQ(range("root.scaleZ").first, -1);  // not moved
}

TEST_F(StarterTrainingTest, WhatMovesAsAWholeIsNotAccelerated) {
  MovingCharacter character;
  character.builder.root["nodes"][0].erase("skin");
  character.Swing("spin", 90, 3, 0);
  std::string remark;
  const std::string text = Starter(character, &remark);
  EXPECT_TRUE(Reload(text).accelerate.empty());
  EXPECT_TRUE(Has(remark, "only moves as a whole")) << remark;
  EXPECT_TRUE(Has(text, "# No accelerate section: it only moves as a whole")) << text;
}

TEST_F(StarterTrainingTest, WhatNothingMovesIsNotAccelerated) {
  MovingCharacter character;
  character.builder.root["nodes"][0].erase("skin");
  character.Animate("rest", 0, "rotation", {0, 2}, {0, 0, 0, 1, 0, 0, 0, 1});
  std::string remark;
  const std::string text = Starter(character, &remark);
  EXPECT_TRUE(Reload(text).accelerate.empty());
  EXPECT_TRUE(Has(remark, "nothing of it moves")) << remark;
}

// Without a clip that moves anything, controls alone train it, and their motion sets the tolerance.
TEST_F(StarterTrainingTest, ControlsAloneTrain) {
  MovingCharacter character;
  character.Animate("rest", 2, "rotation", {0, 2}, {0, 0, 0, 1, 0, 0, 0, 1});
  std::string remark;
  const std::string text = Starter(character, &remark);
  const Rig rig = Reload(text);
  ASSERT_EQ(rig.accelerate.size(), 1u) << text;
  EXPECT_TRUE(rig.accelerate[0].train_clips.empty());
  EXPECT_TRUE(rig.accelerate[0].test_clips.empty());
  EXPECT_EQ(rig.accelerate[0].train_samples, 400);
  EXPECT_TRUE(Has(text, "these ranges are guesses")) << text;
  EXPECT_TRUE(Has(remark, "no clip moves its points")) << remark;
}

// Morph targets that no clip moves are controls, also where a clip holds them at 0.
TEST_F(StarterTrainingTest, MorphTargetsAloneTrain) {
  GltfBuilder builder = GltfBuilder::Character();
  builder.root["nodes"][0].erase("skin");
  builder.root["meshes"][0]["weights"] = {0};
  nlohmann::json& clip = builder.root["animations"][0];
  const int zeros = builder.Accessor<float>({0, 0, 0}, "SCALAR");
  clip["samplers"][1]["output"] = zeros;
  clip["channels"].erase(0);  // and nothing turns
  for (const bool with_clip : {true, false}) {
    if (!with_clip) builder.root.erase("animations");
    const Result<std::string> text = StarterRig(StandardRegistry(), folder.Write("m.gltf", builder.Text()));
    ASSERT_TRUE(text.ok()) << text.status().ToString();
    const Rig rig = Reload(*text);
    ASSERT_EQ(rig.controls.size(), 1u) << *text;
    EXPECT_EQ(rig.controls[0].max, 1);
    ASSERT_EQ(rig.accelerate.size(), 1u) << *text;
    EXPECT_EQ(rig.accelerate[0].train_samples, 400);
  }
}

TEST_F(StarterTrainingTest, Assets) {
  if (SharedFile("assets/head.glb").empty()) GTEST_SKIP() << "no assets beside the checkout";
  const std::vector<std::pair<const char*, double>> expected = {
      {"head.glb", 1e-3}, {"human.glb", 5e-3}, {"Fox.glb", 0.5}, {"robot.glb", 2e-2}};
  for (const auto& [name, tolerance] : expected) {
    StarterOptions options;
    options.character = SharedFile(std::string("assets/") + name);
    const Result<std::string> text = StarterRig(StandardRegistry(), options.character, options);
    ASSERT_TRUE(text.ok()) << text.status().ToString();
    const Rig rig = Reload(*text);
    ASSERT_EQ(rig.accelerate.size(), 1u);
    EXPECT_NEAR(rig.accelerate[0].tolerance, tolerance, 1e-9) << name;
    EXPECT_EQ(rig.accelerate[0].test_clips.size(), 1u) << name;
  }
}

}  // namespace
}  // namespace kpsa::engine
