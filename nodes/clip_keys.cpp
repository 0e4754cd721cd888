#include "nodes/clip_keys.h"

#include <utility>

namespace kpsa::engine {

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

}  // namespace kpsa::engine
