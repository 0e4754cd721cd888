#include "nodes/kernels/soft_mod.h"

#include "base/check.h"

namespace kpsa::engine {
namespace {
constexpr std::size_t kSoftModGrain = 4096;
}

ClusterKernel::ClusterKernel(std::span<const Index> out_points, std::span<const float> point_weights)
    : count_(out_points.size()), weights_(PaddedWeights(point_weights, out_points.size())) {
  const float* w = weights_.data();
  std::size_t first = 0, last = count_;
  while (first < last && w[first] == 0) ++first;
  while (last > first && w[last - 1] == 0) --last;
  begin_ = first / kPointPadding * kPointPadding;
  end_ = last;
}

void ClusterKernel::Run(const Inputs& inputs, ConstPointsView in, PointsView out, std::span<float>,
                        const Parallel* parallel) const noexcept {
  Run(MakeAffineDelta(inputs.delta, inputs.pivot), inputs.envelope, in, out, parallel);
}

void ClusterKernel::Run(const AffineDelta& delta, double strength, ConstPointsView in, PointsView out,
                        const Parallel* parallel) const noexcept {
  KPSA_CHECK_EQ(in.count, count_);
  KPSA_CHECK_EQ(out.count, count_);
  const float envelope = static_cast<float>(strength);
  if (delta.is_zero || envelope == 0 || begin_ >= end_) return CopyPoints(in, out);
  const auto copy = [&](std::size_t begin, std::size_t size) {
    if (size == 0) return;
    CopyPoints({in.x + begin, in.y + begin, in.z + begin, size},
               {out.x + begin, out.y + begin, out.z + begin, size});
  };
  copy(0, begin_);
  ForRanges(parallel, end_ - begin_, kSoftModGrain, [&](std::size_t begin, std::size_t end) {
    ApplyAffineDelta(delta, weights_.data(), envelope, in, out, begin_ + begin, begin_ + end);
  });
  copy(end_, count_ - end_);
}

}  // namespace kpsa::engine
