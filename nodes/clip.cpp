// Keys over time: clipTransform and clipWeights play a node's part of a glTF clip (glTF 2.0, 3.11), animCurve a curve of
// the rig's own.
#include <algorithm>

#include "base/prefetch.h"
#include "graph/geometry.h"
#include "nodes/deformer.h"
#include "nodes/kernels/sampler.h"
#include "nodes/standard_nodes.h"

namespace kpsa {
namespace {

// A sampler's keys as the kernels want them.
struct Keys {
  std::vector<float> times, values;
  SamplerKeys view;  // of these; moving a Keys keeps it valid
  bool empty() const { return times.empty(); }
};

Result<Keys> MakeKeys(const AnimationSampler& sampler, const char* what) {
  Keys keys;
  keys.times.assign(sampler.times.begin(), sampler.times.end());
  keys.values.assign(sampler.values.begin(), sampler.values.end());
  if (keys.empty()) return keys;
  using From = AnimationSampler::Interpolation;
  keys.view = {keys.times, keys.values, static_cast<std::size_t>(sampler.components),
               sampler.interpolation == From::kStep          ? Interpolation::kStep
               : sampler.interpolation == From::kCubicSpline ? Interpolation::kCubicSpline
                                                             : Interpolation::kLinear};
  const Status status = keys.view.Validate();
  if (!status.ok()) return Status::Invalid("{}: {}", what, status.ToString());
  return keys;
}

// Whether a vector channel gives the same value, its first key's, at any time.
bool IsConstant(const SamplerKeys& keys) {
  if (keys.interpolation == Interpolation::kCubicSpline) return false;
  for (std::size_t i = keys.components; i < keys.values.size(); ++i) {
    if (!(keys.values[i] == keys.values[i - keys.components])) return false;
  }
  return true;
}

struct ClipTransformKernel {
  // Which of the times a channel follows; kConstant: its value is in `constant`
  static constexpr int kConstant = -1;
  std::vector<KeyTimes> times;
  int translation_times = kConstant, rotation_times = kConstant, scale_times = kConstant;
  Keys translation, scale;
  RotationTrack rotation;
  Double3 constant_translation, constant_scale;
  Quaternion constant_rotation;
  Matrix4 constant;  // of the constant channels; all of it where no other moves

  int AddTimes(std::vector<float> added) {
    for (std::size_t i = 0; i < times.size(); ++i) {
      if (times[i].times() == added) return static_cast<int>(i);
    }
    times.emplace_back(std::move(added));
    return static_cast<int>(times.size() - 1);
  }
};

Status AddVectorChannel(const AnimationSampler& sampler, const char* what, ClipTransformKernel* kernel, Keys* channel, int* times, Double3* constant) {
  Result<Keys> keys = MakeKeys(sampler, what);
  if (!keys.ok()) return keys.status();
  if (keys->empty()) return Status();
  if (keys->view.components != 3) return Status::Invalid("{} has {} components, expected 3", what, keys->view.components);
  if (IsConstant(keys->view)) {
    *constant = SampleVec3(keys->view, KeySpan());
    return Status();
  }
  *times = kernel->AddTimes(std::move(keys->times));
  keys->view.times = {};
  *channel = std::move(*keys);
  return Status();
}

Result<BoundKernel> BindClipTransform(const Binding& binding) {
  const auto* asset = binding.structural().asset<AnimationKeys>("keys");
  if (asset == nullptr) return Status::Invalid("keys are not set");
  const AnimationKeys::Data& data = asset->data();
  ClipTransformKernel k;
  k.constant_translation = data.rest_translation;
  k.constant_rotation = data.rest_rotation;
  k.constant_scale = data.rest_scale;
  KPSA_RETURN_IF_ERROR(AddVectorChannel(data.translation, "translation", &k, &k.translation, &k.translation_times, &k.constant_translation));
  KPSA_RETURN_IF_ERROR(AddVectorChannel(data.scale, "scale", &k, &k.scale, &k.scale_times, &k.constant_scale));
  Result<Keys> rotation = MakeKeys(data.rotation, "rotation");
  if (!rotation.ok()) return rotation.status();
  if (!rotation->empty()) {
    if (rotation->view.components != 4) return Status::Invalid("rotation has {} components, expected 4", rotation->view.components);
    k.rotation = RotationTrack(rotation->view);
    if (k.rotation.constant()) {
      k.constant_rotation = k.rotation.At(KeySpan());
      k.rotation = RotationTrack();
    } else {
      k.rotation_times = k.AddTimes(std::move(rotation->times));
    }
  }
  k.constant = ComposeTrs(k.constant_translation, k.constant_rotation, k.constant_scale);
  return MakeBound(std::move(k), 0);
}

// The local matrix where find(t) gives the place among the kernel's times[t].
template <typename Find>
void LocalMatrix(const ClipTransformKernel& k, const Find& find, Matrix4* matrix) {
  constexpr int kConstant = ClipTransformKernel::kConstant;
  Double3 translation = k.constant_translation;
  if (k.translation_times != kConstant) translation = SampleVec3(k.translation.view, find(k.translation_times));
  if (k.rotation_times == kConstant && k.scale_times == kConstant) {
    *matrix = k.constant;
    (*matrix)(0, 3) = translation.x, (*matrix)(1, 3) = translation.y, (*matrix)(2, 3) = translation.z;
    return;
  }
  const Double3 scale = k.scale_times == kConstant ? k.constant_scale : SampleVec3(k.scale.view, find(k.scale_times));
  if (k.rotation_times == kConstant) {
    *matrix = ComposeTrs(translation, k.constant_rotation, scale);
    return;
  }
  Matrix4 m = RotationFromUnit(k.rotation.At(find(k.rotation_times)));
  for (int column = 0; column < 3; ++column) {
    for (int row = 0; row < 3; ++row) m(row, column) *= scale[column];
  }
  m(0, 3) = translation.x, m(1, 3) = translation.y, m(2, 3) = translation.z;
  *matrix = m;
}

void ComputeClipTransform(ComputeContext& c) {
  const auto& k = c.kernel_as<ClipTransformKernel>();
  const double time = c.get<double>(0);
  KeySpan span;
  int found = ClipTransformKernel::kConstant;  // the times that `span` was found in
  LocalMatrix(k, [&](int times) -> const KeySpan& {
    if (times != found) span = k.times[static_cast<std::size_t>(times)].Find(time);
    found = times;
    return span;
  }, &c.out_value<Matrix4>(0));
}

// The transforms of a clip together: those with equal times look their keys up once.
struct ClipBatchKernel {
  struct Member {
    const ClipTransformKernel* kernel;
    Index times[3];  // for each of the kernel's: which of `times`
  };
  std::vector<Member> members;
  std::vector<const KeyTimes*> times;  // no two are equal
};

std::shared_ptr<const void> BindClipBatch(std::span<const void* const> kernels) {
  ClipBatchKernel batch;
  for (const void* kernel : kernels) {
    ClipBatchKernel::Member member{static_cast<const ClipTransformKernel*>(kernel), {}};
    for (std::size_t i = 0; i < member.kernel->times.size(); ++i) {
      const KeyTimes& times = member.kernel->times[i];
      const auto equal = [&](const KeyTimes* known) { return known->times() == times.times(); };
      const auto it = std::find_if(batch.times.begin(), batch.times.end(), equal);
      member.times[i] = static_cast<Index>(it - batch.times.begin());
      if (it == batch.times.end()) batch.times.push_back(&times);
    }
    batch.members.push_back(member);
  }
  return std::make_shared<const ClipBatchKernel>(std::move(batch));
}

// Remembers the last few places in key times.
class FoundKeys {
 public:
  explicit FoundKeys(const ClipBatchKernel& batch) : batch_(batch) {}
  const KeySpan& Find(Index times, double time) {
    Entry& entry = entries_[times % kEntries];
    if (entry.times != times || !(entry.time == time)) entry = {times, time, batch_.times[times]->Find(time)};
    return entry.span;
  }

 private:
  static constexpr Index kEntries = 8;
  struct Entry {
    Index times = kNoIndex;
    double time = 0;
    KeySpan span;
  };
  const ClipBatchKernel& batch_;
  Entry entries_[kEntries];
};

void ComputeClipBatch(const BatchContext& c) {
  const auto& batch = c.kernel_as<ClipBatchKernel>();
  for (const auto& member : batch.members) Prefetch(member.kernel, sizeof(ClipTransformKernel));
  FoundKeys found(batch);
  const auto each = [&](auto&& visit) {
    for (std::size_t i = 0; i < batch.members.size(); ++i) {
      const ClipBatchKernel::Member& member = batch.members[i];
      const double time = c.get<double>(i, 0);
      visit(i, *member.kernel, [&](int times) -> const KeySpan& { return found.Find(member.times[times], time); });
    }
  };
  // All keys are on their way before the first one is used
  each([](std::size_t, const ClipTransformKernel& k, auto&& find) {
    constexpr int kConstant = ClipTransformKernel::kConstant;
    if (k.rotation_times != kConstant) k.rotation.PrefetchKeys(find(k.rotation_times));
    if (k.translation_times != kConstant) PrefetchKeys(k.translation.view, find(k.translation_times));
    if (k.scale_times != kConstant) PrefetchKeys(k.scale.view, find(k.scale_times));
  });
  each([&](std::size_t i, const ClipTransformKernel& k, auto&& find) { LocalMatrix(k, find, &c.out_value<Matrix4>(i)); });
}

struct ClipWeightsKernel {
  Keys keys;
  KeyTimes times;
};

Result<BoundKernel> BindClipWeights(const Binding& binding) {
  const auto* asset = binding.structural().asset<AnimationKeys>("keys");
  if (asset == nullptr) return Status::Invalid("keys are not set");
  Result<Keys> keys = MakeKeys(asset->data().weights, "weights");
  if (!keys.ok()) return keys.status();
  ClipWeightsKernel kernel;
  const std::size_t components = keys->view.components;
  if (!keys->empty()) kernel.times = KeyTimes(keys->times);
  kernel.keys = std::move(*keys);
  return MakeBound(std::move(kernel), 2 * components);
}

void ComputeClipWeights(ComputeContext& c) {
  const auto& [keys, times] = c.kernel_as<ClipWeightsKernel>();
  const std::span<double> values(reinterpret_cast<double*>(c.scratch), keys.view.components);
  if (!keys.empty()) SampleScalars(keys.view, times.Find(c.get<double>(0)), values);
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
      .compute(&ComputeClipTransform).bind(BindClipTransform).batch(BindClipBatch, &ComputeClipBatch).cost(120, 0);
  registry.add("clipWeights", "A mesh's part of a clip: its morph weights over time.").category("time").animation()
      .in("time", 0.0, {.unit = Unit::kTime}).structural("keys", Type::kAsset).out("output", Type::kDouble).array()
      .compute(&ComputeClipWeights).bind(BindClipWeights).cost(100, 0);
  registry.add("animCurve", "A curve through keys, over time or over any other value (a set-driven key).").category("time")
      .in("input", 0.0).structural("keyTimes", std::vector<double>{}, {.doc = "ascending"}).structural("keyValues", std::vector<double>{})
      .enumeration("interpolation", {"linear", "step", "smooth"}, true).out("output", Type::kDouble)
      .compute(&ComputeAnimCurve).bind(BindAnimCurve).cost(30, 0);
}

}  // namespace kpsa
