// The transforms of a clip give the same bytes together and one by one.
#include <gtest/gtest.h>

#include <cstring>
#include <random>

#include "graph/geometry.h"
#include "nodes/standard_nodes.h"
#include "tests/support/test_graph.h"

namespace kpsa::engine {
namespace {

const NodeRegistry& Registry() {
  static const NodeRegistry* registry = [] {
    auto* nodes = new NodeRegistry;
    AddStandardNodes(*nodes);
    return nodes;
  }();
  return *registry;
}

class ClipBatchTest : public testing::Test {
 protected:
  double Random(double lo, double hi) { return std::uniform_real_distribution<double>(lo, hi)(random_); }

  AnimationSampler Channel(const std::vector<double>& times, std::size_t components,
                           AnimationSampler::Interpolation interpolation, bool constant) {
    AnimationSampler sampler;
    sampler.interpolation = interpolation;
    sampler.components = static_cast<int>(components);
    sampler.times = times;
    const std::size_t rows = interpolation == AnimationSampler::Interpolation::kCubicSpline ? 3 : 1;
    for (std::size_t i = 0; i < times.size() * rows * components; ++i) {
      sampler.values.push_back(constant && i >= components ? sampler.values[i - components]
                                                           : Random(0.2, 1.5));
    }
    return sampler;
  }

  // Baked and uneven times, all interpolations, channels that are constant or missing.
  std::shared_ptr<const AnimationKeys> Keys(int i) {
    using I = AnimationSampler::Interpolation;
    const std::vector<double>& times = times_[static_cast<std::size_t>(i % 7 == 3 ? 1 : i % 11 == 5 ? 2 : 0)];
    const I interpolation = i % 5 == 4 ? I::kCubicSpline : i % 6 == 5 ? I::kStep : I::kLinear;
    AnimationKeys::Data data;
    data.rest_translation = {Random(-1, 1), Random(-1, 1), Random(-1, 1)};
    data.rest_scale = {1, i % 4 == 0 ? 2.0 : 1.0, 1};
    if (i % 3 != 2) data.translation = Channel(times, 3, interpolation, i % 2 == 0);
    if (i % 8 != 6) data.rotation = Channel(i % 9 == 8 ? times_[1] : times, 4, interpolation, i % 10 == 9);
    if (i % 4 == 1) data.scale = Channel(times, 3, interpolation, i % 8 == 5);
    return std::make_shared<const AnimationKeys>(std::move(data));
  }

  std::mt19937 random_{5};
  std::vector<std::vector<double>> times_ = {{0, 0.25, 0.5, 0.75, 1, 1.25}, {-1, 0.1, 0.7, 0.8, 2}, {0.5}};
};

TEST_F(ClipBatchTest, GivesTheSameBytesAsOneByOne) {
  constexpr int kTransforms = 60;
  TestGraph g(Registry());
  g.add("time", "time");
  g.add("time", "late");
  std::vector<Index> outputs;
  for (int i = 0; i < kTransforms; ++i) {
    const std::string name = "t" + std::to_string(i);
    g.add("clipTransform", name);
    g.hold(name + ".keys", Value(AssetPtr(Keys(i))));
    g.connect(i % 13 == 12 ? "late.time" : "time.time", name + ".time");
    outputs.push_back(g.want(name + ".matrix"));
  }
  g.vary("time.time");
  g.vary("late.time");
  ASSERT_TRUE(g.compile().ok());
  ASSERT_EQ(g.plan->batches().size(), 1u);
  EXPECT_EQ(g.plan->batches()[0].count, static_cast<Index>(kTransforms));

  Evaluator together(g.plan);
  for (double t : {0.0, -3.0, 0.1, 0.25, 0.6, 0.75, 0.7999, 1.1, 1.25, 7.0,
                   std::numeric_limits<double>::quiet_NaN(), 0.3}) {
    for (Evaluator* evaluator : {&together, g.evaluator.get()}) {  // the latter records: one by one
      evaluator->Set(evaluator->plan().FindVarying(g.plug("time.time")), t);
      evaluator->Set(evaluator->plan().FindVarying(g.plug("late.time")), t - 0.37);
      ASSERT_TRUE(evaluator->Evaluate().ok());
    }
    for (int i = 0; i < kTransforms; ++i) {
      const Index output = outputs[static_cast<std::size_t>(i)];
      const Matrix4 &a = together.Get<Matrix4>(output), &b = g.evaluator->Get<Matrix4>(output);
      EXPECT_EQ(std::memcmp(&a, &b, sizeof(Matrix4)), 0) << "transform " << i << " at " << t;
    }
  }
}

}  // namespace
}  // namespace kpsa::engine
