// Animation samplers of glTF (2.0, 3.11 and appendix C): structural keys, no state, double arithmetic.
#pragma once

#include <cstdint>
#include <span>

#include "base/matrix.h"
#include "base/status.h"

namespace kpsa {

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

// All of them want valid keys. Safe from any thread.
Double3 SampleVec3(const SamplerKeys& keys, double seconds);         // components == 3
Quaternion SampleRotation(const SamplerKeys& keys, double seconds);  // components == 4; unit length
void SampleScalars(const SamplerKeys& keys, double seconds,
                   std::span<double> out);  // out.size() == components

}  // namespace kpsa
