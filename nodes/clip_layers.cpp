// Several clips over each other: clipLayer says where in its clip a layer is, layeredTransform and
// layeredWeights blend what the layers' clips say of one node, from the rest pose up.
//   override:  value <- value + weight * (layer - value), rotations by slerp
//   additive:  value <- value + weight * (layer - rest); rotations value * slerp(1, rest^-1 * layer, weight)
// A channel that a layer's clip does not animate is left as it is.
#include <algorithm>
#include <cmath>

#include "base/matrix.h"
#include "nodes/clip_keys.h"
#include "nodes/deformer.h"
#include "nodes/node_file.h"

namespace kpsa::engine {
namespace {

double LayerTime(double time, double start, double speed, bool loop, double duration) {
  const double local = (time - start) * speed;
  if (!loop || !(duration > 0)) return local;
  return local - duration * std::floor(local / duration);
}

// The two modes, of numbers.
struct Mix {
  double weight;
  bool additive;
  double operator()(double value, double layer, double rest) const {
    if (additive) return value + weight * (layer - rest);
    return weight == 1 ? layer : value + weight * (layer - value);
  }
  Double3 operator()(const Double3& value, const Double3& layer, const Double3& rest) const {
    return {(*this)(value.x, layer.x, rest.x), (*this)(value.y, layer.y, rest.y),
            (*this)(value.z, layer.z, rest.z)};
  }
  Quaternion operator()(const Quaternion& value, const Quaternion& layer, const Quaternion& rest) const {
    if (additive) return Normalized(value * Slerp(Quaternion(), Normalized(Conjugate(rest) * layer), weight));
    return weight == 1 ? layer : Slerp(value, layer, weight);
  }
};

// Whether layer i adds: a list that is shorter than the layers means no.
bool IsAdditive(const std::vector<std::int64_t>& additive, int layer) {
  return static_cast<std::size_t>(layer) < additive.size() && additive[static_cast<std::size_t>(layer)] != 0;
}

struct TransformLayer {
  bool additive = false;
  Keys translation, scale;
  RotationTrack rotation;
  KeyTimes translation_times, rotation_times, scale_times;
  bool moves = false, turns = false, scales = false;
};
struct LayeredTransformKernel {
  Double3 rest_translation, rest_scale{1, 1, 1};
  Quaternion rest_rotation;
  std::vector<TransformLayer> layers;
};

Status AddVectorTrack(const AnimationSampler& sampler, const char* what, Keys* keys, KeyTimes* times,
                      bool* has) {
  Result<Keys> made = MakeKeys(sampler, what);
  if (!made.ok()) return made.status();
  if (made->empty()) return Status();
  if (made->view.components != 3)
    return Status::Invalid("{} has {} components, expected 3", what, made->view.components);
  *times = KeyTimes(made->times);
  *keys = std::move(*made);
  *has = true;
  return Status();
}

Result<BoundKernel> BindLayeredTransform(const Binding& binding) {
  const Structural& s = binding.structural();
  const auto& additive = s.value("additive").get<std::vector<std::int64_t>>();
  LayeredTransformKernel kernel;
  for (int i = 0; i < s.array_size("keys"); ++i) {
    const auto* asset = s.asset<AnimationKeys>("keys", i);
    if (asset == nullptr) return Status::Invalid("keys[{}] are not set", i);
    const AnimationKeys::Data& data = asset->data();
    if (i == 0) {
      kernel.rest_translation = data.rest_translation;
      kernel.rest_rotation = Normalized(data.rest_rotation);
      kernel.rest_scale = data.rest_scale;
    }
    TransformLayer layer;
    layer.additive = IsAdditive(additive, i);
    KPSA_RETURN_IF_ERROR(AddVectorTrack(data.translation, "translation", &layer.translation,
                                        &layer.translation_times, &layer.moves));
    KPSA_RETURN_IF_ERROR(
        AddVectorTrack(data.scale, "scale", &layer.scale, &layer.scale_times, &layer.scales));
    Result<Keys> rotation = MakeKeys(data.rotation, "rotation");
    if (!rotation.ok()) return rotation.status();
    if (!rotation->empty()) {
      if (rotation->view.components != 4)
        return Status::Invalid("rotation has {} components, expected 4", rotation->view.components);
      layer.rotation = RotationTrack(rotation->view);
      layer.rotation_times = KeyTimes(std::move(rotation->times));
      layer.turns = true;
    }
    kernel.layers.push_back(std::move(layer));
  }
  return MakeBound(std::move(kernel), 0);
}

void ComputeLayeredTransform(
    NodeContext<In<"time", ArrayView<double>>, In<"weight", ArrayView<double>>, Out<"matrix", Matrix4>> c) {
  const auto& k = c.kernel_as<LayeredTransformKernel>();
  const ArrayView<double> times = c.get<"time">(), weights = c.get<"weight">();
  Double3 translation = k.rest_translation, scale = k.rest_scale;
  Quaternion rotation = k.rest_rotation;
  for (std::uint32_t i = 0; i < k.layers.size() && i < times.size(); ++i) {
    const TransformLayer& layer = k.layers[i];
    const Mix mix{i < weights.size() ? weights[i] : 1, layer.additive};
    if (mix.weight == 0) continue;
    const double time = times[i];
    if (layer.moves)
      translation = mix(translation, SampleVec3(layer.translation.view, layer.translation_times.Find(time)),
                        k.rest_translation);
    if (layer.turns)
      rotation = mix(rotation, layer.rotation.At(layer.rotation_times.Find(time)), k.rest_rotation);
    if (layer.scales)
      scale = mix(scale, SampleVec3(layer.scale.view, layer.scale_times.Find(time)), k.rest_scale);
  }
  c.out<"matrix">() = ComposeTrs(translation, rotation, scale);
}

struct WeightsLayer {
  bool additive = false;
  Keys keys;
  KeyTimes times;
};
struct LayeredWeightsKernel {
  std::vector<double> rest;
  std::vector<WeightsLayer> layers;
};

Result<BoundKernel> BindLayeredWeights(const Binding& binding) {
  const Structural& s = binding.structural();
  const auto& additive = s.value("additive").get<std::vector<std::int64_t>>();
  LayeredWeightsKernel kernel;
  kernel.rest = s.value("rest").get<std::vector<double>>();
  std::size_t most = 0;
  for (int i = 0; i < s.array_size("keys"); ++i) {
    const auto* asset = s.asset<AnimationKeys>("keys", i);
    if (asset == nullptr) return Status::Invalid("keys[{}] are not set", i);
    Result<Keys> keys = MakeKeys(asset->data().weights, "weights");
    if (!keys.ok()) return keys.status();
    WeightsLayer layer;
    layer.additive = IsAdditive(additive, i);
    if (!keys->empty()) {
      layer.times = KeyTimes(keys->times);
      most = std::max(most, keys->view.components);
    }
    layer.keys = std::move(*keys);
    kernel.layers.push_back(std::move(layer));
  }
  return MakeBound(std::move(kernel), 2 * most);
}

void ComputeLayeredWeights(NodeContext<In<"time", ArrayView<double>>, In<"weight", ArrayView<double>>,
                                       Out<"output", OutArray<double>>>
                               c) {
  const auto& k = c.kernel_as<LayeredWeightsKernel>();
  const ArrayView<double> times = c.get<"time">(), weights = c.get<"weight">();
  const OutArray<double> out = c.out<"output">();
  const std::uint32_t count = out.size();
  const auto rest_of = [&](std::size_t n) { return n < k.rest.size() ? k.rest[n] : 0.0; };
  for (std::uint32_t n = 0; n < count; ++n) out[n] = rest_of(n);
  for (std::uint32_t i = 0; i < k.layers.size() && i < times.size(); ++i) {
    const WeightsLayer& layer = k.layers[i];
    const Mix mix{i < weights.size() ? weights[i] : 1, layer.additive};
    if (layer.keys.empty() || mix.weight == 0) continue;
    const std::span<double> values(reinterpret_cast<double*>(c.scratch()), layer.keys.view.components);
    SampleScalars(layer.keys.view, layer.times.Find(times[i]), values);
    for (std::uint32_t n = 0; n < count && n < values.size(); ++n)
      out[n] = mix(out[n], values[n], rest_of(n));
  }
}

// Declares what all that blend layers have: time, weight, keys and kind of each.
NodeBuilder AddLayered(NodeRegistry& registry, std::string name, std::string doc) {
  NodeBuilder b = registry.add(std::move(name), std::move(doc));
  b.category("time").animation();
  b.in("time", 0.0, {.unit = Unit::kTime, .doc = "in the layer's clip"}).array();
  b.in("weight", 1.0, {.min = 0, .max = 1, .doc = "of the layer"}).array();
  b.structural("keys", Type::kAsset).array();
  b.structural("additive", std::vector<std::int64_t>{},
               {.doc = "1 for a layer that adds to those below, 0 for one that replaces them"});
  return b;
}

}  // namespace

KPSA_NODES(clip_layers, registry) {
  registry.add("clipLayer", "Where a layer of clips is in its clip: (time - start) * speed.")
      .category("time")
      .animation()
      .in("time", 0.0, {.unit = Unit::kTime})
      .in("start", 0.0, {.unit = Unit::kTime, .doc = "when the clip begins"})
      .in("speed", 1.0, {.doc = "seconds of the clip a second"})
      .in("loop", false, {.doc = "begins again after its duration"})
      .in("duration", 0.0, {.min = 0, .unit = Unit::kTime, .doc = "of the clip"})
      .in("weight", 1.0, {.min = 0, .max = 1, .doc = "of the layer; what blends it reads it here"})
      .out("localTime", Type::kDouble)
      .unit(Unit::kTime)
      .compute_for({"localTime"}, {"time", "start", "speed", "loop", "duration"},
                   [](double time, double start, double speed, bool loop, double duration) {
                     return LayerTime(time, start, speed, loop, duration);
                   })
      .cost(15, 0);
  AddLayered(registry, "layeredTransform",
             "A transform's part of several clips over each other: its local matrix over time.")
      .out("matrix", Type::kMatrix)
      .compute<ComputeLayeredTransform>()
      .bind(BindLayeredTransform)
      .cost(250, 0);
  AddLayered(registry, "layeredWeights",
             "A mesh's part of several clips over each other: its morph weights over time.")
      .structural("rest", std::vector<double>{}, {.doc = "weights where no layer plays"})
      .out("output", Type::kDouble)
      .array()
      .compute<ComputeLayeredWeights>()
      .bind(BindLayeredWeights)
      .cost(200, 0);
}

}  // namespace kpsa::engine
