// Keys over time: clipTransform and clipWeights play a node's part of a glTF clip (glTF 2.0, 3.11), animCurve
// a curve of the rig's own.
#include <algorithm>

#include "base/prefetch.h"
#include "base/scalar_math.h"
#include "graph/geometry.h"
#include "nodes/clip_keys.h"
#include "nodes/deformer.h"
#include "nodes/kernels/sampler.h"
#include "nodes/node_file.h"

namespace kpsa::engine {
namespace {

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

Status AddVectorChannel(const AnimationSampler& sampler, const char* what, ClipTransformKernel* kernel,
                        Keys* channel, int* times, Double3* constant) {
  Result<Keys> keys = MakeKeys(sampler, what);
  if (!keys.ok()) return keys.status();
  if (keys->empty()) return Status();
  if (keys->view.components != 3)
    return Status::Invalid("{} has {} components, expected 3", what, keys->view.components);
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
  KPSA_RETURN_IF_ERROR(AddVectorChannel(data.translation, "translation", &k, &k.translation,
                                        &k.translation_times, &k.constant_translation));
  KPSA_RETURN_IF_ERROR(
      AddVectorChannel(data.scale, "scale", &k, &k.scale, &k.scale_times, &k.constant_scale));
  Result<Keys> rotation = MakeKeys(data.rotation, "rotation");
  if (!rotation.ok()) return rotation.status();
  if (!rotation->empty()) {
    if (rotation->view.components != 4)
      return Status::Invalid("rotation has {} components, expected 4", rotation->view.components);
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

// ComposeTrs of a rotation of unit length, written in place: a matrix that is made elsewhere and copied in wide pieces
// waits for its elements' stores.
void WriteTrs(const Double3& translation, const Quaternion& q, const Double3& scale, Matrix4* matrix) {
  std::array<double, 16>& m = matrix->m;
  const double xx = q.x * q.x, yy = q.y * q.y, zz = q.z * q.z, xy = q.x * q.y, xz = q.x * q.z, yz = q.y * q.z,
               xw = q.x * q.w, yw = q.y * q.w, zw = q.z * q.w;
  m[0] = (1 - 2 * (yy + zz)) * scale.x, m[1] = 2 * (xy + zw) * scale.x, m[2] = 2 * (xz - yw) * scale.x,
  m[3] = 0;
  m[4] = 2 * (xy - zw) * scale.y, m[5] = (1 - 2 * (xx + zz)) * scale.y, m[6] = 2 * (yz + xw) * scale.y,
  m[7] = 0;
  m[8] = 2 * (xz + yw) * scale.z, m[9] = 2 * (yz - xw) * scale.z, m[10] = (1 - 2 * (xx + yy)) * scale.z,
  m[11] = 0;
  m[12] = translation.x, m[13] = translation.y, m[14] = translation.z, m[15] = 1;
}

// The local matrix where find(t) gives the place among the kernel's times[t].
template <typename Find>
void LocalMatrix(const ClipTransformKernel& k, const Find& find, Matrix4* matrix) {
  constexpr int kConstant = ClipTransformKernel::kConstant;
  Double3 translation = k.constant_translation;
  if (k.translation_times != kConstant)
    translation = SampleVec3(k.translation.view, find(k.translation_times));
  if (k.rotation_times == kConstant && k.scale_times == kConstant) {
    *matrix = k.constant;
    (*matrix)(0, 3) = translation.x, (*matrix)(1, 3) = translation.y, (*matrix)(2, 3) = translation.z;
    return;
  }
  const Double3 scale =
      k.scale_times == kConstant ? k.constant_scale : SampleVec3(k.scale.view, find(k.scale_times));
  if (k.rotation_times == kConstant) {
    *matrix = ComposeTrs(translation, k.constant_rotation, scale);
    return;
  }
  WriteTrs(translation, k.rotation.At(find(k.rotation_times)), scale, matrix);
}

void ComputeClipTransform(NodeContext<In<"time", double>, Out<"matrix", Matrix4>> c) {
  const auto& k = c.kernel_as<ClipTransformKernel>();
  const double time = c.get<"time">();
  KeySpan span;
  int found = ClipTransformKernel::kConstant;  // the times that `span` was found in
  LocalMatrix(
      k,
      [&](int times) -> const KeySpan& {
        if (times != found) span = k.times[static_cast<std::size_t>(times)].Find(time);
        found = times;
        return span;
      },
      &c.out<"matrix">());
}

// The transforms of a clip together: those with equal times look their keys up once.
struct ClipBatchKernel {
  // Turns by linear keys about a constant place: what most joints do. One line of the caches.
  struct alignas(64) Turn {
    const RotationTrack::Key* keys;
    Double3 translation, scale;
    Index times, position;  // in `times` and in the batch
  };
  struct Other {
    const ClipTransformKernel* kernel;
    Index times[3];  // for each of the kernel's: which of `times`
    Index position;
  };
  std::vector<Turn> turns;
  std::vector<Other> others;
  std::vector<const KeyTimes*> times;  // no two are equal
};

std::shared_ptr<const void> BindClipBatch(std::span<const void* const> kernels) {
  constexpr int kConstant = ClipTransformKernel::kConstant;
  ClipBatchKernel batch;
  for (std::size_t at = 0; at < kernels.size(); ++at) {
    const auto& k = *static_cast<const ClipTransformKernel*>(kernels[at]);
    ClipBatchKernel::Other other{&k, {}, static_cast<Index>(at)};
    for (std::size_t i = 0; i < k.times.size(); ++i) {
      const auto equal = [&](const KeyTimes* known) { return known->times() == k.times[i].times(); };
      const auto it = std::find_if(batch.times.begin(), batch.times.end(), equal);
      other.times[i] = static_cast<Index>(it - batch.times.begin());
      if (it == batch.times.end()) batch.times.push_back(&k.times[i]);
    }
    if (k.rotation_times != kConstant && k.rotation.linear_keys() != nullptr &&
        k.translation_times == kConstant && k.scale_times == kConstant) {
      batch.turns.push_back({k.rotation.linear_keys(), k.constant_translation, k.constant_scale,
                             other.times[k.rotation_times], other.position});
    } else {
      batch.others.push_back(other);
    }
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

void ComputeClipBatch(NodeBatch<In<"time", double>, Out<"matrix", Matrix4>> c) {
  const auto& batch = c.kernel_as<ClipBatchKernel>();
  FoundKeys found(batch);
  const auto span_of = [&](const ClipBatchKernel::Turn& turn) -> const KeySpan& {
    return found.Find(turn.times, c.get<"time">(turn.position));
  };
  // The keys of each are on their way some turns before they are used
  constexpr std::size_t kAhead = 12;
  const std::size_t turns = batch.turns.size();
  const auto prefetch = [&](std::size_t i) {
    Prefetch(batch.turns[i].keys + span_of(batch.turns[i]).key, 2 * sizeof(RotationTrack::Key));
  };
  for (std::size_t i = 0; i < std::min(kAhead, turns); ++i) prefetch(i);
  for (std::size_t i = 0; i < turns; ++i) {
    if (i + kAhead < turns) prefetch(i + kAhead);
    const ClipBatchKernel::Turn& turn = batch.turns[i];
    const KeySpan& span = span_of(turn);
    const RotationTrack::Key* key = turn.keys + span.key;
    WriteTrs(turn.translation, span.t == 0 ? key->rotation : RotationTrack::Between(key, span.t), turn.scale,
             &c.out<"matrix">(turn.position));
  }
  for (const ClipBatchKernel::Other& other : batch.others) {
    const double time = c.get<"time">(other.position);
    LocalMatrix(
        *other.kernel, [&](int times) -> const KeySpan& { return found.Find(other.times[times], time); },
        &c.out<"matrix">(other.position));
  }
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

void ComputeClipWeights(NodeContext<In<"time", double>, Out<"output", OutArray<double>>> c) {
  const auto& [keys, times] = c.kernel_as<ClipWeightsKernel>();
  const std::span<double> values(reinterpret_cast<double*>(c.scratch()), keys.view.components);
  if (!keys.empty()) SampleScalars(keys.view, times.Find(c.get<"time">()), values);
  const OutArray<double> out = c.out<"output">();
  for (std::uint32_t i = 0; i < out.size(); ++i)
    out[i] = !keys.empty() && i < values.size() ? values[i] : 0.0;
}

enum class CurveInterpolation { kLinear, kStep, kSmooth };

struct CurveKernel {
  std::vector<double> times, values;
  CurveInterpolation interpolation;
};

Result<BoundKernel> BindAnimCurve(const Binding& binding) {
  const Structural& s = binding.structural();
  CurveKernel kernel;
  kernel.times = s.value("keyTimes").get<std::vector<double>>();
  kernel.values = s.value("keyValues").get<std::vector<double>>();
  kernel.interpolation = s.choice<CurveInterpolation>("interpolation");
  if (kernel.times.empty()) return Status::Invalid("keyTimes holds no key");
  if (kernel.times.size() != kernel.values.size()) {
    return Status::Invalid("keyTimes has {} entries, keyValues {}", kernel.times.size(),
                           kernel.values.size());
  }
  for (std::size_t i = 1; i < kernel.times.size(); ++i) {
    if (!(kernel.times[i] > kernel.times[i - 1]))
      return Status::Invalid("keyTimes must ascend: entry {} is {}, the one before {}", i, kernel.times[i],
                             kernel.times[i - 1]);
  }
  return MakeBound(std::move(kernel), 0);
}

void ComputeAnimCurve(NodeContext<In<"input", double>, Out<"output", double>> c) {
  const auto& k = c.kernel_as<CurveKernel>();
  const double t = std::clamp(c.get<"input">(), k.times.front(), k.times.back());
  const auto next =
      static_cast<std::size_t>(std::upper_bound(k.times.begin(), k.times.end(), t) - k.times.begin());
  if (next == k.times.size()) {
    c.out<"output">() = k.values.back();
    return;
  }
  const double a = k.values[next - 1], b = k.values[next];
  double u = (t - k.times[next - 1]) / (k.times[next] - k.times[next - 1]);
  if (k.interpolation == CurveInterpolation::kStep) u = 0;
  if (k.interpolation == CurveInterpolation::kSmooth) u = Smoothstep(u);
  c.out<"output">() = a + (b - a) * u;
}

void AddAnimCurve(NodeRegistry& registry, const char* name, const char* doc, Unit unit) {
  registry.add(name, doc)
      .category("time")
      .in("input", 0.0)
      .structural("keyTimes", std::vector<double>{}, {.doc = "ascending"})
      .structural("keyValues", std::vector<double>{}, {.unit = unit})
      .enumeration<CurveInterpolation>("interpolation",
                                       {{"linear", CurveInterpolation::kLinear},
                                        {"step", CurveInterpolation::kStep},
                                        {"smooth", CurveInterpolation::kSmooth}},
                                       true)
      .out("output", Type::kDouble)
      .unit(unit)
      .compute<ComputeAnimCurve>()
      .bind(BindAnimCurve)
      .cost(30, 0);
}

}  // namespace

KPSA_NODES(clip, registry) {
  registry.add("clipTransform", "A transform's part of a clip: its local matrix over time.")
      .category("time")
      .animation()
      .in("time", 0.0, {.unit = Unit::kTime})
      .structural("keys", Type::kAsset)
      .out("matrix", Type::kMatrix)
      .compute<ComputeClipTransform>()
      .bind(BindClipTransform)
      .batch<ComputeClipBatch>(BindClipBatch)
      .cost(120, 0);
  registry.add("clipWeights", "A mesh's part of a clip: its morph weights over time.")
      .category("time")
      .animation()
      .in("time", 0.0, {.unit = Unit::kTime})
      .structural("keys", Type::kAsset)
      .out("output", Type::kDouble)
      .array()
      .compute<ComputeClipWeights>()
      .bind(BindClipWeights)
      .cost(100, 0);
  AddAnimCurve(registry, "animCurve",
               "A curve through keys, over time or over any other value (a set-driven key).", Unit::kNone);
  AddAnimCurve(registry, "animCurveUU", "A set-driven key: a number over a number.", Unit::kNone);
  AddAnimCurve(registry, "animCurveUA", "A set-driven key: an angle over a number.", Unit::kAngle);
  AddAnimCurve(registry, "animCurveUL", "A set-driven key: a length over a number.", Unit::kLength);
}

}  // namespace kpsa::engine
