#include "nodes/kernels/sampler.h"

#include <algorithm>
#include <cmath>

#include "base/check.h"
#include "base/scalar_math.h"

namespace kpsa::engine {
namespace {

// Keys have times of single precision (glTF 2.0, 3.11), and frames do not: frame 8 of 24 is a third of a second, which a
// file may have as 0.33333334, and an ulp later, where i * (1 / 24) came out like that. What holds its keys is told by
// times that are rounded as they are.
double AsKeysAre(double seconds) {
  constexpr double kUlp = 0x1p-23;
  return static_cast<float>(seconds + kUlp * std::abs(seconds));
}

// seconds: at least the time of the key, and before the next one.
KeySpan SpanFrom(std::span<const float> times, std::size_t key, double seconds) {
  const double start = times[key], next = times[key + 1], width = next - start;
  return {key, (seconds - start) / width, width, AsKeysAre(seconds) >= next ? key + 1 : key};
}

KeySpan Find(std::span<const float> times, double seconds) {
  if (!(seconds > static_cast<double>(times.front()))) return {};  // NaN goes to the first key
  if (seconds >= static_cast<double>(times.back())) return {times.size() - 1, 0, 0, times.size() - 1};
  const auto next = std::upper_bound(times.begin(), times.end(), seconds,
                                     [](double s, float t) { return s < static_cast<double>(t); });
  return SpanFrom(times, static_cast<std::size_t>(next - times.begin()) - 1, seconds);
}

// Which of the three parts of a cubic key.
enum Part : std::size_t { kInTangent = 0, kValue = 1, kOutTangent = 2 };

double At(const SamplerKeys& keys, std::size_t key, Part part, std::size_t component) {
  const bool cubic = keys.interpolation == Interpolation::kCubicSpline;
  const std::size_t row = cubic ? 3 * key + part : key;
  return keys.values[row * keys.components + component];
}

double Sample(const SamplerKeys& keys, const KeySpan& span, std::size_t component) {
  if (keys.interpolation == Interpolation::kStep) return At(keys, span.held, kValue, component);
  const double v0 = At(keys, span.key, kValue, component);
  if (span.t == 0) return v0;
  const double v1 = At(keys, span.key + 1, kValue, component), t = span.t;
  if (keys.interpolation == Interpolation::kLinear) return v0 + (v1 - v0) * t;
  // glTF 2.0, appendix C.5: Hermite with tangents a second
  const double b0 = At(keys, span.key, kOutTangent, component) * span.width;
  const double a1 = At(keys, span.key + 1, kInTangent, component) * span.width;
  const double t2 = t * t, t3 = t2 * t;
  return (2 * t3 - 3 * t2 + 1) * v0 + (t3 - 2 * t2 + t) * b0 + (3 * t2 - 2 * t3) * v1 + (t3 - t2) * a1;
}

double Dot(const Quaternion& a, const Quaternion& b) { return a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w; }

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

KeyTimes::KeyTimes(std::vector<float> times) : times_(std::move(times)) {
  KPSA_CHECK(!times_.empty());
  first_ = times_.front();
  last_ = times_.back();
  if (last_ > first_) rate_ = static_cast<double>(times_.size() - 1) / (last_ - first_);
}

KeySpan KeyTimes::Find(double seconds) const {
  if (!(seconds > first_)) return {};
  if (seconds >= last_) return {times_.size() - 1, 0, 0, times_.size() - 1};
  const auto at = [&](std::size_t key) { return static_cast<double>(times_[key]); };
  const std::size_t guess = std::min(static_cast<std::size_t>((seconds - first_) * rate_), times_.size() - 2);
  if (at(guess) <= seconds && seconds < at(guess + 1)) return SpanFrom(times_, guess, seconds);
  // at(low) <= seconds < at(high); close in from the guess by doubling steps, then by halves
  std::size_t low = 0, high = times_.size() - 1;
  for (std::size_t from = guess, step = 1; from > low && from < high; step *= 2) {
    const bool below = at(from) <= seconds;
    (below ? low : high) = from;
    from = below ? from + step : from - std::min(step, from);
  }
  while (high - low > 1) {
    const std::size_t middle = (low + high) / 2;
    (at(middle) <= seconds ? low : high) = middle;
  }
  return SpanFrom(times_, low, seconds);
}

RotationTrack::RotationTrack(const SamplerKeys& keys) : step_(keys.interpolation == Interpolation::kStep) {
  KPSA_CHECK_EQ(keys.components, 4u);
  if (keys.interpolation == Interpolation::kCubicSpline) {
    cubic_.assign(keys.values.begin(), keys.values.end());
    return;
  }
  keys_.resize(keys.times.size());
  for (std::size_t k = 0; k < keys_.size(); ++k) {
    Quaternion q = KeyRotation(keys, k);
    if (k > 0) {
      Key& before = keys_[k - 1];
      double cosine = Dot(before.rotation, q);
      if (cosine < 0) q = {-q.x, -q.y, -q.z, -q.w}, cosine = -cosine;
      if (cosine < 1 - 1e-9) {  // as Slerp does
        before.angle = Acos(cosine);
        before.inverse = 1 / std::sqrt((1 - cosine) * (1 + cosine));
      }
    }
    keys_[k].rotation = q;
  }
}

Quaternion RotationTrack::At(const KeySpan& span) const {
  if (!cubic_.empty()) {
    const SamplerKeys keys{{}, cubic_, 4, Interpolation::kCubicSpline};
    return Normalized(
        {Sample(keys, span, 0), Sample(keys, span, 1), Sample(keys, span, 2), Sample(keys, span, 3)});
  }
  if (step_) return keys_[span.held].rotation;
  if (span.t == 0) return keys_[span.key].rotation;
  return Between(keys_.data() + span.key, span.t);
}

Quaternion RotationTrack::Between(const Key* from, double t) {
  const Quaternion &a = from[0].rotation, &b = from[1].rotation;
  double wa = 1 - t, wb = t;
  if (from->inverse != 0) {
    wa = Sin(wa * from->angle) * from->inverse;
    wb = Sin(wb * from->angle) * from->inverse;
  }
  return {a.x * wa + b.x * wb, a.y * wa + b.y * wb, a.z * wa + b.z * wb, a.w * wa + b.w * wb};
}

bool RotationTrack::constant() const {
  return cubic_.empty() && std::all_of(keys_.begin(), keys_.end(),
                                       [&](const Key& k) { return k.rotation == keys_.front().rotation; });
}

Double3 SampleVec3(const SamplerKeys& keys, const KeySpan& span) {
  KPSA_CHECK_EQ(keys.components, 3u);
  return {Sample(keys, span, 0), Sample(keys, span, 1), Sample(keys, span, 2)};
}
Double3 SampleVec3(const SamplerKeys& keys, double seconds) {
  return SampleVec3(keys, Find(keys.times, seconds));
}

Quaternion SampleRotation(const SamplerKeys& keys, double seconds) {
  KPSA_CHECK_EQ(keys.components, 4u);
  const KeySpan span = Find(keys.times, seconds);
  if (keys.interpolation == Interpolation::kStep) return KeyRotation(keys, span.held);
  if (span.t == 0) return KeyRotation(keys, span.key);
  if (keys.interpolation == Interpolation::kLinear) {
    return Slerp(KeyRotation(keys, span.key), KeyRotation(keys, span.key + 1), span.t);
  }
  return Normalized(
      {Sample(keys, span, 0), Sample(keys, span, 1), Sample(keys, span, 2), Sample(keys, span, 3)});
}

void SampleScalars(const SamplerKeys& keys, const KeySpan& span, std::span<double> out) {
  KPSA_CHECK_EQ(keys.components, out.size());
  if (keys.interpolation == Interpolation::kLinear && span.t != 0) {  // as Sample does, side by side
    const auto from = keys.values.subspan(span.key * out.size(), 2 * out.size());
    const double t = span.t;
    for (std::size_t c = 0; c < out.size(); ++c) {
      const double v0 = from[c], v1 = from[out.size() + c];
      out[c] = v0 + (v1 - v0) * t;
    }
    return;
  }
  for (std::size_t c = 0; c < out.size(); ++c) out[c] = Sample(keys, span, c);
}
void SampleScalars(const SamplerKeys& keys, double seconds, std::span<double> out) {
  SampleScalars(keys, Find(keys.times, seconds), out);
}

}  // namespace kpsa::engine
