#include "nodes/kernels/wrap_run.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/kernels/driver_frames_run.cpp"
#include "hwy/foreach_target.h"

#include "nodes/kernels/blocks-inl.h"

HWY_BEFORE_NAMESPACE();
namespace kpsa::engine {
namespace HWY_NAMESPACE {

// Frames of kFrameGroup points with rings of `size` spokes, as many at once as vectors hold: sums over the spokes,
// in the order of the ring, of edge * dual and of edge x next edge.
HWY_INLINE void FrameGroup(const FramesRun& run, std::size_t group, const float* HWY_RESTRICT driver,
                           float* HWY_RESTRICT frames) {
  const std::size_t first = run.first[group], size = run.first[group + 1] - first;
  for (std::size_t at = 0; at < kFrameGroup; at += kBlocks) {
    const Index* HWY_RESTRICT spokes = run.spokes + kFrameGroup * first + at;
    const float* HWY_RESTRICT duals = run.duals + 4 * (kFrameGroup * first + at);
    const Blocks own = GatherBlocks(driver, run.own + kFrameGroup * group + at);
    Blocks x = ZeroBlocks(), y = x, z = x, forward = x, backward = x;
    if (size > 0) {
      Blocks last = SubBlocks(GatherBlocks(driver, spokes + kFrameGroup * (size - 1)), own);
      Blocks last_turned = YzxBlocks(last);
      for (std::size_t k = 0; k < size; ++k, spokes += kFrameGroup, duals += 4 * kFrameGroup) {
        const Blocks edge = SubBlocks(GatherBlocks(driver, spokes), own), turned = YzxBlocks(edge);
        const Blocks dual = LoadBlocks(duals);
        x = FmaBlocks(edge, SplatInBlocks<0>(dual), x);
        y = FmaBlocks(edge, SplatInBlocks<1>(dual), y);
        z = FmaBlocks(edge, SplatInBlocks<2>(dual), z);
        forward = FmaBlocks(last, turned, forward);
        backward = FmaBlocks(last_turned, edge, backward);
        last = edge, last_turned = turned;
      }
    }
    const Blocks normal = UnitBlocks(YzxBlocks(SubBlocks(forward, backward)));
    const Blocks dual = LoadBlocks(run.normal_duals + 4 * (kFrameGroup * group + at));
    x = WithSpare(FmaBlocks(normal, SplatInBlocks<0>(dual), x), SplatInBlocks<0>(own));
    y = WithSpare(FmaBlocks(normal, SplatInBlocks<1>(dual), y), SplatInBlocks<1>(own));
    z = WithSpare(FmaBlocks(normal, SplatInBlocks<2>(dual), z), SplatInBlocks<2>(own));
    float* to = frames + kFrameFloats * (kFrameGroup * group + at);
    ScatterBlocks(x, to, kFrameFloats);
    ScatterBlocks(y, to + 4, kFrameFloats);
    ScatterBlocks(z, to + 8, kFrameFloats);
    ScatterBlocks(normal, to + 12, kFrameFloats);
  }
}

void FramesOf(const FramesRun& run, const float* driver, std::size_t begin, std::size_t end, float* frames) {
  for (std::size_t group = begin; group < end; ++group) FrameGroup(run, group, driver, frames);
}

}  // namespace HWY_NAMESPACE
}  // namespace kpsa::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace kpsa::engine {

HWY_EXPORT(FramesOf);

void RunDriverFrames(const FramesRun& run, const float* driver, std::size_t begin, std::size_t end,
                     float* frames) noexcept {
  HWY_DYNAMIC_DISPATCH(FramesOf)(run, driver, begin, end, frames);
}

}  // namespace kpsa::engine
#endif  // HWY_ONCE
