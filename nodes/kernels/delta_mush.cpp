#include "nodes/kernels/delta_mush.h"

#include "base/check.h"
#include "nodes/kernels/delta_mush_run.h"
#include "nodes/kernels/weights.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/kernels/delta_mush.cpp"
#include "hwy/foreach_target.h"

#include "nodes/kernels/xyzw-inl.h"

HWY_BEFORE_NAMESPACE();
namespace kpsa::engine {
namespace HWY_NAMESPACE {

// The points minus the pivot, as xyzw by local number.
void PackLocal(ConstPointsView in, const Index* source, const float* pivot, std::size_t begin,
               std::size_t end, float* xyzw) {
  if (source != nullptr) {
    for (std::size_t i = begin; i < end; ++i) {
      const Index p = source[i];
      float* to = xyzw + 4 * i;
      to[0] = in.x[p] - pivot[0], to[1] = in.y[p] - pivot[1], to[2] = in.z[p] - pivot[2], to[3] = 0;
    }
    return;
  }
  const DLanes d;
  const VLanes px = hn::Set(d, pivot[0]), py = hn::Set(d, pivot[1]), pz = hn::Set(d, pivot[2]);
  for (std::size_t i = begin; i < end; i += hn::Lanes(d)) {
    hn::StoreInterleaved4(hn::Sub(hn::Load(d, in.x + i), px), hn::Sub(hn::Load(d, in.y + i), py),
                          hn::Sub(hn::Load(d, in.z + i), pz), hn::Zero(d), d, xyzw + 4 * i);
  }
}

// The sum over neighbours, alike or weighted with a sum of 1.
template <std::size_t n, std::size_t e, bool kWeighted>
HWY_INLINE F4 AddNeighbors(const float* HWY_RESTRICT from, const Index* HWY_RESTRICT neighbors,
                           const float* HWY_RESTRICT weights, F4 sum) {
  const F4 neighbor = Load4(from + EntryOf<e, n + 1>(neighbors));
  if constexpr (kWeighted) {
    sum = e == 0 ? Mul4(SplatOf4<e>(weights), neighbor) : Fma4(SplatOf4<e>(weights), neighbor, sum);
  } else {
    sum = e == 0 ? neighbor : Add4(sum, neighbor);
  }
  if constexpr (e + 1 < n) sum = AddNeighbors<n, e + 1, kWeighted>(from, neighbors, weights, sum);
  return sum;
}

template <std::size_t n, bool kWeighted>  // n = 0: at run time
HWY_INLINE void SmoothGroup(const MushRows& rows, const float* HWY_RESTRICT from, float* HWY_RESTRICT to) {
  const std::size_t neighbor_count = n == 0 ? rows.neighbor_count : n, count = rows.count;
  const Index* HWY_RESTRICT neighbors = rows.rows;
  const float* HWY_RESTRICT weights = rows.weights;
  const F4 step = Splat4(rows.step), less = Splat4(kWeighted ? -1.0f : -static_cast<float>(neighbor_count));
  for (std::size_t i = 0; i < count; ++i, neighbors += neighbor_count + 1) {
    F4 sum;
    Index own;
    if constexpr (n != 0) {
      sum = AddNeighbors<n, 0, kWeighted>(from, neighbors, weights, Zero4());
      own = EntryOf<n, n + 1>(neighbors);
    } else {
      sum = Load4(from + neighbors[0]);
      if constexpr (kWeighted) sum = Mul4(Splat4(weights[0]), sum);
      for (std::size_t j = 1; j < neighbor_count; ++j) {
        const F4 neighbor = Load4(from + neighbors[j]);
        sum = kWeighted ? Fma4(Splat4(weights[j]), neighbor, sum) : Add4(sum, neighbor);
      }
      own = neighbors[neighbor_count];
    }
    if constexpr (kWeighted) weights += neighbor_count;
    const F4 s = Load4(from + own);
    Store4(Fma4(step, Fma4(less, s, sum), s), to + own);
  }
}

template <bool kWeighted>
HWY_INLINE void SmoothRowsOf(const MushRows& rows, const float* from, float* to) {
  switch (rows.neighbor_count) {
    case 3:
      return SmoothGroup<3, kWeighted>(rows, from, to);
    case 4:
      return SmoothGroup<4, kWeighted>(rows, from, to);
    case 5:
      return SmoothGroup<5, kWeighted>(rows, from, to);
    case 6:
      return SmoothGroup<6, kWeighted>(rows, from, to);
    case 7:
      return SmoothGroup<7, kWeighted>(rows, from, to);
    case 8:
      return SmoothGroup<8, kWeighted>(rows, from, to);
    default:
      return SmoothGroup<0, kWeighted>(rows, from, to);
  }
}

// One iteration of a group.
void SmoothRows(const MushRows& rows, const float* from, float* to) {
  if (rows.neighbor_count == 0) {
    for (std::size_t i = 0; i < rows.count; ++i) Store4(Load4(from + rows.rows[i]), to + rows.rows[i]);
    return;
  }
  if (rows.weights != nullptr) return SmoothRowsOf<true>(rows, from, to);
  SmoothRowsOf<false>(rows, from, to);
}

}  // namespace HWY_NAMESPACE
}  // namespace kpsa::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace kpsa::engine {

HWY_EXPORT(PackLocal);
HWY_EXPORT(SmoothRows);

void PackMush(ConstPointsView in, const Index* source, const float* pivot, std::size_t begin, std::size_t end,
              float* xyzw) noexcept {
  HWY_DYNAMIC_DISPATCH(PackLocal)(in, source, pivot, begin, end, xyzw);
}

const float* DeltaMushKernel::Smooth(ConstPointsView in, const float* pivot, std::span<float> scratch,
                                     const Parallel* parallel) const noexcept {
  float *from = scratch.data(), *to = from + BufferFloats();
  ForRanges(parallel, local_count_, 8192, [&](std::size_t begin, std::size_t end) {
    PackMush(in, source_.empty() ? nullptr : source_.data(), pivot, begin, end, from);
  });
  for (int j = 1; j <= iterations_; ++j) {
    ForRanges(parallel, block_counts_[static_cast<std::size_t>(j)], 4,
              [&](std::size_t begin, std::size_t end) {
                const auto smooth_rows = HWY_DYNAMIC_DISPATCH(SmoothRows);
                for (Index g = blocks_[begin]; g < blocks_[end]; ++g) {
                  const Group& group = groups_[g];
                  const float* weights =
                      neighbor_weights_.empty() ? nullptr : neighbor_weights_.data() + group.first_weight;
                  smooth_rows({rows_.data() + group.first, weights, group.neighbors, group.count, group.step},
                              from, to);
                }
              });
    std::swap(from, to);
  }
  return from;
}

void DeltaMushKernel::Run(const Inputs& inputs, ConstPointsView in, PointsView out, std::span<float> scratch,
                          const Parallel* parallel) const noexcept {
  KPSA_CHECK_EQ(in.count, in_count_);
  KPSA_CHECK_EQ(out.count, count_);
  KPSA_CHECK_LE(ScratchFloats(), scratch.size());
  const float envelope = static_cast<float>(inputs.envelope);
  if (!frames_.changes() || envelope == 0) return frames_.Pass(in, out);
  const float pivot[3] = {static_cast<float>(inputs.pivot.x), static_cast<float>(inputs.pivot.y),
                          static_cast<float>(inputs.pivot.z)};
  const float* smoothed = Smooth(in, pivot, scratch, parallel);
  frames_.Run({envelope, static_cast<float>(inputs.displacement), {pivot[0], pivot[1], pivot[2]}}, smoothed,
              in, out, parallel);
}

}  // namespace kpsa::engine
#endif  // HWY_ONCE
