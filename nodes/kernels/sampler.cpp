#include "nodes/kernels/sampler.h"

#include <algorithm>
#include <cmath>

#include "base/check.h"

namespace kpsa {
namespace {

// Between which keys a time lies: value = key `a` at t = 0 to key `a + 1` at t = 1, `width` seconds apart.
struct Span {
  std::size_t a = 0;
  double t = 0, width = 0;
};

Span Find(const SamplerKeys& keys, double seconds) {
  const auto& times = keys.times;
  if (!(seconds > static_cast<double>(times.front()))) return {};  // NaN goes to the first key
  if (seconds >= static_cast<double>(times.back())) return {times.size() - 1, 0, 0};
  std::size_t low = 0, high = times.size() - 1;  // times[low] <= seconds < times[high]
  while (high - low > 1) {
    const std::size_t middle = (low + high) / 2;
    (static_cast<double>(times[middle]) <= seconds ? low : high) = middle;
  }
  const double start = times[low], width = static_cast<double>(times[high]) - start;
  return {low, (seconds - start) / width, width};
}

// Which of the three parts of a cubic key.
enum Part : std::size_t { kInTangent = 0, kValue = 1, kOutTangent = 2 };

double At(const SamplerKeys& keys, std::size_t key, Part part, std::size_t component) {
  const bool cubic = keys.interpolation == Interpolation::kCubicSpline;
  const std::size_t row = cubic ? 3 * key + part : key;
  return keys.values[row * keys.components + component];
}

double Sample(const SamplerKeys& keys, const Span& span, std::size_t component) {
  const double v0 = At(keys, span.a, kValue, component);
  if (span.t == 0 || keys.interpolation == Interpolation::kStep) return v0;
  const double v1 = At(keys, span.a + 1, kValue, component), t = span.t;
  if (keys.interpolation == Interpolation::kLinear) return v0 + (v1 - v0) * t;
  // glTF 2.0, appendix C.5: Hermite with tangents a second
  const double b0 = At(keys, span.a, kOutTangent, component) * span.width;
  const double a1 = At(keys, span.a + 1, kInTangent, component) * span.width;
  const double t2 = t * t, t3 = t2 * t;
  return (2 * t3 - 3 * t2 + 1) * v0 + (t3 - 2 * t2 + t) * b0 + (3 * t2 - 2 * t3) * v1 + (t3 - t2) * a1;
}

Quaternion KeyRotation(const SamplerKeys& keys, std::size_t key) {
  return Normalized({At(keys, key, kValue, 0), At(keys, key, kValue, 1), At(keys, key, kValue, 2),
                     At(keys, key, kValue, 3)});
}

}  // namespace

Status SamplerKeys::Validate() const {
  if (times.empty()) return Status::Invalid("an animation sampler without keys, expected at least one");
  if (components == 0) return Status::Invalid("an animation sampler of 0 components, expected at least 1");
  const std::size_t rows = interpolation == Interpolation::kCubicSpline ? 3 : 1;
  // Divide rather than multiply: the product may overflow
  if (values.size() % components != 0 || values.size() / components % rows != 0 ||
      values.size() / components / rows != times.size()) {
    return Status::Invalid("an animation sampler of {} keys and {} numbers, expected {} numbers a key",
                           times.size(), values.size(), rows * components);
  }
  for (std::size_t i = 0; i < times.size(); ++i) {
    if (!std::isfinite(times[i])) return Status::Invalid("the time of key {} is not a finite number", i);
    if (i > 0 && !(times[i] > times[i - 1])) {
      return Status::Invalid("the time of key {} ({} s) does not come after that of key {} ({} s)", i,
                             times[i], i - 1, times[i - 1]);
    }
  }
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!std::isfinite(values[i])) {
      return Status::Invalid("a value of key {} is not a finite number", i / (components * rows));
    }
  }
  return {};
}

Double3 SampleVec3(const SamplerKeys& keys, double seconds) {
  KPSA_CHECK_EQ(keys.components, 3u);
  const Span span = Find(keys, seconds);
  return {Sample(keys, span, 0), Sample(keys, span, 1), Sample(keys, span, 2)};
}

Quaternion SampleRotation(const SamplerKeys& keys, double seconds) {
  KPSA_CHECK_EQ(keys.components, 4u);
  const Span span = Find(keys, seconds);
  if (span.t == 0 || keys.interpolation == Interpolation::kStep) return KeyRotation(keys, span.a);
  if (keys.interpolation == Interpolation::kLinear) {
    return Slerp(KeyRotation(keys, span.a), KeyRotation(keys, span.a + 1), span.t);
  }
  return Normalized(
      {Sample(keys, span, 0), Sample(keys, span, 1), Sample(keys, span, 2), Sample(keys, span, 3)});
}

void SampleScalars(const SamplerKeys& keys, double seconds, std::span<double> out) {
  KPSA_CHECK_EQ(keys.components, out.size());
  const Span span = Find(keys, seconds);
  for (std::size_t c = 0; c < out.size(); ++c) out[c] = Sample(keys, span, c);
}

}  // namespace kpsa
