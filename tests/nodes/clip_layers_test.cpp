// Layers of clips: the formulas of nodes/clip_layers.cpp on keys whose values are known at any time.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "base/matrix.h"
#include "graph/geometry.h"
#include "nodes/standard_nodes.h"
#include "tests/support/test_graph.h"

namespace kpsa::engine {
namespace {

const NodeRegistry& Nodes() {
  static const NodeRegistry* registry = [] {
    auto* nodes = new NodeRegistry;
    AddStandardNodes(*nodes);
    return nodes;
  }();
  return *registry;
}

AnimationSampler Track(std::vector<double> from, std::vector<double> to) {  // from 0 s to 1 s
  AnimationSampler sampler;
  sampler.components = static_cast<int>(from.size());
  sampler.times = {0, 1};
  sampler.values = std::move(from);
  sampler.values.insert(sampler.values.end(), to.begin(), to.end());
  return sampler;
}

std::shared_ptr<const AnimationKeys> Keys(AnimationKeys::Data data) {
  data.rest_translation = {1, 2, 3};
  data.rest_scale = {1, 2, 1};
  data.rest_rotation = {0, 0, std::sqrt(0.5), std::sqrt(0.5)};  // a quarter turn about Z
  return std::make_shared<const AnimationKeys>(std::move(data));
}

TEST(ClipLayer, TimeOfItsClip) {
  TestGraph g(Nodes());
  g.add("clipLayer", "l", {{"start", 2.0}, {"speed", 0.5}, {"duration", 3.0}});
  g.vary("l.time");
  g.want("l.localTime");
  for (const double time : {-4.0, 2.0, 3.0, 40.0}) {
    g.set("l.time", time);
    EXPECT_DOUBLE_EQ(g.pull<double>("l.localTime"), (time - 2) / 2);
  }
  g.hold("l.loop", Value(true));
  for (const auto& [time, local] : {std::pair(2.0, 0.0), {7.0, 2.5}, {8.0, 0.0}, {9.0, 0.5}, {1.0, 2.5}}) {
    g.set("l.time", time);
    EXPECT_DOUBLE_EQ(g.pull<double>("l.localTime"), local) << time;
  }
  g.hold("l.duration", 0.0);  // a clip of one key
  g.set("l.time", 9.0);
  EXPECT_DOUBLE_EQ(g.pull<double>("l.localTime"), 3.5);
}

// Translations against the formula, for random layers.
TEST(LayeredTransform, TranslationsAreThoseOfTheFormula) {
  std::mt19937 random(3);
  const auto number = [&](double lo, double hi) {
    return std::uniform_real_distribution<double>(lo, hi)(random);
  };
  for (int round = 0; round < 20; ++round) {
    TestGraph g(Nodes());
    g.add("layeredTransform", "t");
    std::vector<std::int64_t> additive;
    const Double3 rest{1, 2, 3};
    Double3 expected = rest;
    for (int i = 0; i < round % 5; ++i) {
      const bool has = number(0, 1) < 0.8, adds = number(0, 1) < 0.5;
      const Double3 a{number(-1, 1), 0, 2}, b{number(-1, 1), 4, number(0, 1)};
      AnimationKeys::Data data;
      if (has) data.translation = Track({a.x, a.y, a.z}, {b.x, b.y, b.z});
      const double time = number(-0.5, 1.5), weight = i % 2 == 0 ? 1 : number(0, 1);
      const std::string element = "[" + std::to_string(i) + "]";
      g.hold("t.keys" + element, Value(AssetPtr(Keys(data))));
      g.hold("t.time" + element, time);
      g.hold("t.weight" + element, weight);
      additive.push_back(adds ? 1 : 0);
      if (!has) continue;
      const double u = std::clamp(time, 0.0, 1.0);
      const Double3 value = a * (1 - u) + b * u;
      expected = adds ? expected + weight * (value - rest) : expected + weight * (value - expected);
    }
    if (round % 5 == 0) g.hold("t.keys[0]", Value(AssetPtr(Keys({})))), g.hold("t.time[0]", 0.0);
    g.hold("t.additive", Value(additive));
    const Matrix4 m = g.pull<Matrix4>("t.matrix");
    EXPECT_LT(Length(Double3{m(0, 3), m(1, 3), m(2, 3)} - expected), 1e-6) << round;
    // What no layer animates is at rest
    EXPECT_NEAR(m(1, 0), 1, 1e-12);
    EXPECT_NEAR(m(0, 1), -2, 1e-12);
  }
}

TEST(LayeredTransform, RotationsAndScales) {
  // From rest, 90 degrees about Z, to 150; scale from rest to 3 times rest along X
  const double angle = 150 * 3.14159265358979323846 / 360;
  AnimationKeys::Data data;
  data.rotation = Track({0, 0, std::sqrt(0.5), std::sqrt(0.5)}, {0, 0, std::sin(angle), std::cos(angle)});
  data.scale = Track({1, 2, 1}, {3, 2, 1});
  for (const bool adds : {false, true}) {
    TestGraph g(Nodes());
    g.add("layeredTransform", "t", {{"additive", Value(std::vector<std::int64_t>{0, adds ? 1 : 0})}});
    for (const char* element : {"[0]", "[1]"}) {
      g.hold(std::string("t.keys") + element, Value(AssetPtr(Keys(data))));
      g.hold(std::string("t.time") + element, 1.0);
      g.hold(std::string("t.weight") + element, 0.5);
    }
    const Matrix4 m = g.pull<Matrix4>("t.matrix");
    const double degrees = std::atan2(m(1, 0), m(0, 0)) * 180 / 3.14159265358979323846;
    EXPECT_NEAR(degrees, adds ? 90 + 30 + 30 : 90 + 30 + 15, 1e-4);
    EXPECT_NEAR(std::hypot(m(0, 0), m(1, 0)), adds ? 3 : 2.5, 1e-6);
  }
}

TEST(LayeredWeights, GoFromTheirRest) {
  AnimationKeys::Data data;
  data.weights = Track({0, 1}, {1, 0});
  TestGraph g(Nodes());
  g.add("layeredWeights", "w",
        {{"rest", Value(std::vector<double>{0.5, 0.25, 0.125})},
         {"additive", Value(std::vector<std::int64_t>{0, 1})}});
  for (const char* element : {"[0]", "[1]"})
    g.hold(std::string("w.keys") + element, Value(AssetPtr(Keys(data))));
  g.hold("w.time[0]", 0.25), g.hold("w.weight[0]", 0.5);
  g.hold("w.time[1]", 1.0), g.hold("w.weight[1]", 0.1);
  EXPECT_NEAR(g.pull<double>("w.output[0]"), 0.375 + 0.1 * 0.5, 1e-7);
  EXPECT_NEAR(g.pull<double>("w.output[1]"), 0.5 - 0.1 * 0.25, 1e-7);
  EXPECT_NEAR(g.pull<double>("w.output[2]"), 0.125, 1e-12) << "no clip has a third weight";
}

TEST(LayeredTransform, BadKeysAreRefused) {
  TestGraph g(Nodes());
  AnimationKeys::Data data;
  data.translation = Track({0, 0}, {1, 1});
  g.add("layeredTransform", "t", {{"keys[0]", Value(AssetPtr(Keys(data)))}});
  g.hold("t.time[0]", 0.0);
  const Status status = g.try_pull("t.matrix");
  EXPECT_NE(status.ToString().find("translation has 2 components, expected 3"), std::string::npos)
      << status.ToString();
}

}  // namespace
}  // namespace kpsa::engine
