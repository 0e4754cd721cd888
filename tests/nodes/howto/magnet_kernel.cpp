#include "tests/nodes/howto/magnet_kernel.h"

#include <utility>

namespace kpsa::engine {

MagnetKernel::MagnetKernel(FalloffFade fade, std::vector<float> weights)
    : fade_(fade), weights_(std::move(weights)) {}

void MagnetKernel::Run(const Inputs& inputs, ConstPointsView in, PointsView out,
                       const Parallel* parallel) const {
  ForRanges(parallel, in.count, 2048, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Double3 p{in.x[i], in.y[i], in.z[i]}, way = inputs.place - p;
      const double distance = Length(way);
      const double near = distance < inputs.radius ? DistanceFalloff(distance, inputs.radius, fade_) : 0;
      const double share = near * inputs.strength * (weights_.empty() ? 1.0f : weights_[i]);
      out.x[i] = share == 0 ? in.x[i] : static_cast<float>(p.x + share * way.x);
      out.y[i] = share == 0 ? in.y[i] : static_cast<float>(p.y + share * way.y);
      out.z[i] = share == 0 ? in.z[i] : static_cast<float>(p.z + share * way.z);
    }
  });
}

}  // namespace kpsa::engine
