// Animation samplers of glTF (2.0, 3.11 and appendix C): structural keys, no state, double arithmetic.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/matrix.h"
#include "base/status.h"

namespace kpsa::engine {

enum class Interpolation : std::uint8_t { kStep, kLinear, kCubicSpline };

// Keys of one channel. Times ascend strictly, in seconds; times outside of them are clamped.
// values: `components` numbers a key (kCubicSpline: in-tangent, value, out-tangent: three times as many).
struct SamplerKeys {
  std::span<const float> times;
  std::span<const float> values;
  std::size_t components = 3;
  Interpolation interpolation = Interpolation::kLinear;
  // Names: no keys, times that do not ascend or are not finite, a number of values that does not fit, values
  // not finite.
  Status Validate() const;
};

// Between which keys a time lies: value = key `key` at t = 0 to key `key + 1` at t = 1, `width` seconds
// apart. At and beyond the ends, and for NaN, t is 0.
struct KeySpan {
  std::size_t key = 0;
  double t = 0, width = 0;
  std::size_t held =
      0;  // the key that kStep shows: the next one already up to two ulps (of single precision) before it
};

// Ascending times that several channels may share. A look-up starts where the key would be if all were evenly
// spaced: it reads one or two times of baked clips, and searches otherwise. It remembers nothing between
// calls.
class KeyTimes {
 public:
  KeyTimes() = default;
  explicit KeyTimes(std::vector<float> times);  // ascending, finite, one at least
  KeySpan Find(double seconds) const;
  const std::vector<float>& times() const { return times_; }

 private:
  std::vector<float> times_;
  double first_ = 0, last_ = 0, rate_ = 0;  // rate: keys a second
};

// A channel of rotations with everything precomputed that belongs to a pair of keys.
class RotationTrack {
 public:
  RotationTrack() = default;
  explicit RotationTrack(const SamplerKeys& keys);  // valid, 4 components; copied
  // Unit length but for rounding; the same turn as SampleRotation's.
  Quaternion At(const KeySpan& span) const;
  bool constant() const;  // the same rotation at any time

  struct Key {            // of kLinear and kStep
    Quaternion rotation;  // unit length, on the side of the key before: the short way without a sign
    double angle = 0, inverse = 0;  // to the next key, and 1 / sin(angle); 0 where they are nearly equal
  };
  // The keys of kLinear, null for others. At(span) is keys[span.key] where span.t is 0, and
  // Between(&keys[span.key], span.t) elsewhere.
  const Key* linear_keys() const { return cubic_.empty() && !step_ ? keys_.data() : nullptr; }
  static Quaternion Between(const Key* from, double t);  // of from[0] and from[1]

 private:
  std::vector<Key> keys_;
  std::vector<float> cubic_;
  bool step_ = false;
};

// All of them want valid keys. Safe from any thread.
Double3 SampleVec3(const SamplerKeys& keys,
                   const KeySpan& span);  // components == 3; keys.times are not looked at
void SampleScalars(const SamplerKeys& keys, const KeySpan& span, std::span<double> out);
Double3 SampleVec3(const SamplerKeys& keys, double seconds);         // components == 3
Quaternion SampleRotation(const SamplerKeys& keys, double seconds);  // components == 4; unit length
void SampleScalars(const SamplerKeys& keys, double seconds,
                   std::span<double> out);  // out.size() == components

}  // namespace kpsa::engine
