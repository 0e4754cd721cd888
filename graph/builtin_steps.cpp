#include "graph/builtin_steps.h"

#include <cmath>
#include <cstring>

namespace kpsa::engine {
namespace {

void Gather(const std::vector<Index>& positions, const float* from, float* to) {
  const std::size_t count = positions.size();
  for (std::size_t i = 0; i < count; ++i) to[i] = from[positions[i]];
}

}  // namespace

void ComputeGatherPoints(ComputeContext& context) {
  const auto& positions = context.kernel_as<std::vector<Index>>();
  const ConstPointsView& from = context.slot<ConstPointsView>(0);
  const PointsView& to = context.out_slot<PointsView>(0);
  Gather(positions, from.x, to.x);
  Gather(positions, from.y, to.y);
  Gather(positions, from.z, to.z);
}

void ComputeGatherWeights(ComputeContext& context) {
  Gather(context.kernel_as<std::vector<Index>>(), context.slot<ConstPointsView>(0).x,
         context.out_slot<PointsView>(0).x);
}

void ComputeAssembleSmall(ComputeContext& context) {
  const auto& kernel = context.kernel_as<AssembleKernel>();
  auto* out = context.values + context.out[0];
  std::memcpy(out, context.values + context.in[0], kernel.value_size);
  for (std::size_t i = 0; i < kernel.children.size(); ++i) {
    std::memcpy(out + 8 * kernel.children[i], context.values + context.in[1 + i], 8);
  }
}

void ComputeAssemblePoints(ComputeContext& context) {
  const auto& kernel = context.kernel_as<AssembleKernel>();
  const ConstPointsView& from = context.slot<ConstPointsView>(0);
  const PointsView& to = context.out_slot<PointsView>(0);
  float* out[3] = {to.x, to.y, to.z};
  const float* in[3] = {from.x, from.y, from.z};
  for (int c = 0; c < 3; ++c) {
    if (out[c] != nullptr && out[c] != in[c]) std::memcpy(out[c], in[c], to.count * sizeof(float));
  }
  for (std::size_t i = 0; i < kernel.children.size(); ++i) {
    if (kernel.children[i] < 0) continue;
    const auto point = static_cast<std::size_t>(kernel.children[i] / 4);
    const int component = kernel.children[i] % 4;
    if (component < 3) {
      out[component][point] = static_cast<float>(context.slot<double>(static_cast<int>(1 + i)));
    } else if (to.y == nullptr) {
      out[0][point] = static_cast<float>(context.slot<double>(static_cast<int>(1 + i)));
    } else {
      for (int c = 0; c < 3; ++c)
        out[c][point] = static_cast<float>(context.slot<Double3>(static_cast<int>(1 + i))[c]);
    }
  }
}

void ComputeIntToDouble(ComputeContext& context) {
  context.out_slot<double>(0) = static_cast<double>(context.slot<std::int64_t>(0));
}
void ComputeDoubleToInt(ComputeContext& context) {
  context.out_slot<std::int64_t>(0) = WholeNumber(context.slot<double>(0));
}
void ComputeDoubleToBool(ComputeContext& context) {
  context.out_slot<std::int64_t>(0) = context.slot<double>(0) != 0;
}
void ComputeIntToBool(ComputeContext& context) {
  context.out_slot<std::int64_t>(0) = context.slot<std::int64_t>(0) != 0;
}

}  // namespace kpsa::engine
