// Keys over time: clipTransform and clipWeights play a node's part of a glTF clip (glTF 2.0, 3.11), animCurve a curve of
// the rig's own.
#include <algorithm>

#include "base/scalar_math.h"
#include "graph/geometry.h"
#include "nodes/deformer.h"
#include "nodes/kernels/sampler.h"
#include "nodes/standard_nodes.h"

namespace kpsa {
namespace {

// A sampler's keys as the kernel wants them.
struct Keys {
  std::vector<float> times, values;
  SamplerKeys view;
  bool empty() const { return times.empty(); }
};

Result<std::unique_ptr<Keys>> MakeKeys(const AnimationSampler& sampler, const char* what) {
  auto keys = std::make_unique<Keys>();
  keys->times.assign(sampler.times.begin(), sampler.times.end());
  keys->values.assign(sampler.values.begin(), sampler.values.end());
  if (keys->empty()) return keys;
  using From = AnimationSampler::Interpolation;
  keys->view = {keys->times, keys->values, static_cast<std::size_t>(sampler.components),
                sampler.interpolation == From::kStep          ? Interpolation::kStep
                : sampler.interpolation == From::kCubicSpline ? Interpolation::kCubicSpline
                                                              : Interpolation::kLinear};
  const Status status = keys->view.Validate();
  if (!status.ok()) return Status::Invalid("{}: {}", what, status.ToString());
  return keys;
}

struct ClipTransformKernel {
  std::unique_ptr<Keys> translation, rotation, scale;
  Double3 rest_translation, rest_scale;
  Quaternion rest_rotation;
};

Result<BoundKernel> BindClipTransform(const Binding& binding) {
  const auto* asset = binding.structural().asset<AnimationKeys>("keys");
  if (asset == nullptr) return Status::Invalid("keys are not set");
  const AnimationKeys::Data& data = asset->data();
  ClipTransformKernel kernel;
  kernel.rest_translation = data.rest_translation;
  kernel.rest_rotation = data.rest_rotation;
  kernel.rest_scale = data.rest_scale;
  for (auto [sampler, keys, what] : {std::tuple{&data.translation, &kernel.translation, "translation"},
                                     std::tuple{&data.rotation, &kernel.rotation, "rotation"}, std::tuple{&data.scale, &kernel.scale, "scale"}}) {
    Result<std::unique_ptr<Keys>> made = MakeKeys(*sampler, what);
    if (!made.ok()) return made.status();
    *keys = std::move(*made);
  }
  return BoundKernel{std::make_shared<const ClipTransformKernel>(std::move(kernel)), 0, 0};
}

void ComputeClipTransform(ComputeContext& c) {
  const auto& k = c.kernel_as<ClipTransformKernel>();
  const double time = c.get<double>(0);
  const Double3 translation = k.translation->empty() ? k.rest_translation : SampleVec3(k.translation->view, time);
  const Quaternion rotation = k.rotation->empty() ? k.rest_rotation : SampleRotation(k.rotation->view, time);
  const Double3 scale = k.scale->empty() ? k.rest_scale : SampleVec3(k.scale->view, time);
  c.out_value<Matrix4>(0) = ComposeTrs(translation, rotation, scale);
}

Result<BoundKernel> BindClipWeights(const Binding& binding) {
  const auto* asset = binding.structural().asset<AnimationKeys>("keys");
  if (asset == nullptr) return Status::Invalid("keys are not set");
  Result<std::unique_ptr<Keys>> keys = MakeKeys(asset->data().weights, "weights");
  if (!keys.ok()) return keys.status();
  const std::size_t components = (*keys)->view.components;
  return BoundKernel{std::shared_ptr<const Keys>(std::move(*keys)), 2 * components, 0};
}

void ComputeClipWeights(ComputeContext& c) {
  const auto& keys = c.kernel_as<Keys>();
  const std::span<double> values(reinterpret_cast<double*>(c.scratch), keys.view.components);
  if (!keys.empty()) SampleScalars(keys.view, c.get<double>(0), values);
  const std::uint32_t* table = c.out + c.out[0];
  for (std::uint32_t i = 0; i < table[0]; ++i) {
    *reinterpret_cast<double*>(c.values + table[1 + i]) = !keys.empty() && i < values.size() ? values[i] : 0.0;
  }
}

struct CurveKernel {
  std::vector<double> times, values;
  int interpolation;  // linear, step, smooth
};

Result<BoundKernel> BindAnimCurve(const Binding& binding) {
  const Structural& s = binding.structural();
  CurveKernel kernel;
  kernel.times = s.value("keyTimes").get<std::vector<double>>();
  kernel.values = s.value("keyValues").get<std::vector<double>>();
  kernel.interpolation = s.get_int("interpolation");
  if (kernel.times.empty()) return Status::Invalid("keyTimes holds no key");
  if (kernel.times.size() != kernel.values.size()) {
    return Status::Invalid("keyTimes has {} entries, keyValues {}", kernel.times.size(), kernel.values.size());
  }
  for (std::size_t i = 1; i < kernel.times.size(); ++i) {
    if (!(kernel.times[i] > kernel.times[i - 1])) return Status::Invalid("keyTimes must ascend: entry {} is {}, the one before {}", i, kernel.times[i], kernel.times[i - 1]);
  }
  return MakeBound(std::move(kernel), 0);
}

void ComputeAnimCurve(ComputeContext& c) {
  const auto& k = c.kernel_as<CurveKernel>();
  const double t = std::clamp(c.get<double>(0), k.times.front(), k.times.back());
  const auto next = static_cast<std::size_t>(std::upper_bound(k.times.begin(), k.times.end(), t) - k.times.begin());
  if (next == k.times.size()) {
    c.out_value<double>(0) = k.values.back();
    return;
  }
  const double a = k.values[next - 1], b = k.values[next];
  double u = (t - k.times[next - 1]) / (k.times[next] - k.times[next - 1]);
  if (k.interpolation == 1) u = 0;
  if (k.interpolation == 2) u = u * u * (3 - 2 * u);
  c.out_value<double>(0) = a + (b - a) * u;
}

}  // namespace

void AddClipNodes(NodeRegistry& registry) {
  registry.add("clipTransform", "A transform's part of a clip: its local matrix over time.").category("time").animation()
      .in("time", 0.0, {.unit = Unit::kTime}).structural("keys", Type::kAsset).out("matrix", Type::kMatrix)
      .compute(&ComputeClipTransform).bind(BindClipTransform).cost(120, 0);
  registry.add("clipWeights", "A mesh's part of a clip: its morph weights over time.").category("time").animation()
      .in("time", 0.0, {.unit = Unit::kTime}).structural("keys", Type::kAsset).out("output", Type::kDouble).array()
      .compute(&ComputeClipWeights).bind(BindClipWeights).cost(100, 0);
  registry.add("animCurve", "A curve through keys, over time or over any other value (a set-driven key).").category("time")
      .in("input", 0.0).structural("keyTimes", std::vector<double>{}, {.doc = "ascending"}).structural("keyValues", std::vector<double>{})
      .enumeration("interpolation", {"linear", "step", "smooth"}, true).out("output", Type::kDouble)
      .compute(&ComputeAnimCurve).bind(BindAnimCurve).cost(30, 0);
}

}  // namespace kpsa
