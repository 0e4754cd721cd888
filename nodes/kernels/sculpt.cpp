#include "nodes/kernels/sculpt.h"

#include "base/check.h"
#include "nodes/kernels/weights.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/kernels/sculpt.cpp"
#include "hwy/foreach_target.h"

#include "nodes/kernels/handle_frame-inl.h"

#ifndef KPSA_NODES_KERNELS_SCULPT_RUN_
#define KPSA_NODES_KERNELS_SCULPT_RUN_
namespace kpsa::engine {
// What one Run hands to the vector code.
struct SculptRun {
  HandleFrame frame;
  SculptMode mode;
  bool linear;             // and with a distance over which it fades
  float distance, fading;  // and 1 / distance
  float most;              // that a point moves
  float stretch[3];
  const float* weights;
  float envelope;
};
}  // namespace kpsa::engine
#endif

HWY_BEFORE_NAMESPACE();
namespace kpsa::engine {
namespace HWY_NAMESPACE {

// How far along its radius a point goes; r is its distance from the centre.
HWY_INLINE VLanes WayOut(const SculptRun& run, VLanes r) {
  const DLanes d;
  const VLanes one = hn::Set(d, 1.0f), inside = hn::Sub(one, r), distance = hn::Set(d, run.distance);
  if (run.mode == SculptMode::kFlip) {
    if (!run.linear) return hn::IfThenElseZero(hn::Lt(r, one), inside);
    const VLanes shell = hn::Add(one, distance);
    return hn::IfThenElseZero(hn::Lt(r, shell), Fma(hn::Div(r, shell), distance, inside));
  }
  const VLanes apart = hn::Abs(inside);
  const VLanes share = run.linear ? hn::Sub(one, hn::Mul(apart, hn::Set(d, run.fading))) : one;
  return hn::IfThenElseZero(hn::Lt(apart, distance), hn::Mul(inside, share));
}

// How far along the direction of the stretch.
HWY_INLINE VLanes WayAlong(const SculptRun& run, VLanes x, VLanes y, VLanes z, VLanes r) {
  const DLanes d;
  const VLanes one = hn::Set(d, 1.0f), zero = hn::Zero(d);
  const auto outside = hn::Gt(r, one);
  // Of a point outside, that of the surface below it
  const VLanes scale = hn::IfThenElse(outside, hn::Div(one, r), one);
  const VLanes along =
      hn::Mul(scale, Fma(x, hn::Set(d, run.stretch[0]),
                         Fma(y, hn::Set(d, run.stretch[1]), hn::Mul(z, hn::Set(d, run.stretch[2])))));
  const VLanes depth = Fma(hn::Neg(r), r, one);
  const VLanes inside = hn::IfThenElse(hn::Or(outside, hn::Lt(depth, zero)), zero, depth);
  const VLanes exit = hn::Sub(hn::Sqrt(Fma(along, along, inside)), along);
  const VLanes beyond = hn::IfThenElseZero(outside, hn::Mul(hn::Sub(r, one), hn::Set(d, run.fading)));
  const VLanes fade = run.linear ? hn::Sub(one, beyond) : one;
  return hn::IfThenElseZero(hn::Lt(r, hn::Set(d, 1 + run.distance)), hn::Mul(exit, fade));
}

void SculptLanes(const SculptRun& run, ConstPointsView in, PointsView out, std::size_t begin,
                 std::size_t end) {
  const DLanes d;
  const VLanes most = hn::Set(d, run.most), least = hn::Set(d, -run.most);
  const auto move = [&](VLanes* x, VLanes* y, VLanes* z) HWY_ATTR {
    const VLanes r = hn::Sqrt(Fma(*x, *x, Fma(*y, *y, hn::Mul(*z, *z))));
    const bool one_way = run.mode == SculptMode::kStretch;
    VLanes way = one_way ? WayAlong(run, *x, *y, *z, r) : WayOut(run, r);
    way = hn::IfThenElse(hn::Gt(way, most), most, hn::IfThenElse(hn::Lt(way, least), least, way));
    if (one_way) {
      *x = hn::Mul(way, hn::Set(d, run.stretch[0]));
      *y = hn::Mul(way, hn::Set(d, run.stretch[1]));
      *z = hn::Mul(way, hn::Set(d, run.stretch[2]));
    } else {
      const VLanes share = hn::IfThenElseZero(hn::Gt(r, hn::Zero(d)), hn::Div(way, r));
      *x = hn::Mul(*x, share), *y = hn::Mul(*y, share), *z = hn::Mul(*z, share);
    }
  };
  MoveInFrame(run.frame, run.weights, run.envelope, in, out, begin, end, move);
}

}  // namespace HWY_NAMESPACE
}  // namespace kpsa::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace kpsa::engine {
namespace {
constexpr std::size_t kSculptGrain = 2048;
constexpr float kLeastDistance = 1e-30f;  // of what is divided by in floats
}  // namespace

HWY_EXPORT(SculptLanes);

SculptKernel::SculptKernel(std::span<const Index> out_points, std::span<const float> point_weights)
    : count_(out_points.size()), weights_(PaddedWeights(point_weights, out_points.size())) {}

void SculptKernel::Run(const Inputs& inputs, ConstPointsView in, PointsView out,
                       const Parallel* parallel) const noexcept {
  KPSA_CHECK_EQ(in.count, count_);
  KPSA_CHECK_EQ(out.count, count_);
  const SculptShape& shape = inputs.shape;
  SculptRun run;
  run.mode = shape.mode;
  run.distance = static_cast<float>(shape.dropoff_distance);
  run.linear = shape.dropoff == SculptDropoff::kLinear && run.distance > kLeastDistance;
  run.fading = run.linear ? 1 / run.distance : 0;
  run.most = static_cast<float>(shape.max_displacement);
  for (int i = 0; i < 3; ++i) run.stretch[i] = static_cast<float>(shape.stretch[i]);
  run.weights = weights_.data();
  run.envelope = static_cast<float>(inputs.envelope);
  if (run.envelope == 0 || !PrepareHandleFrame(inputs.stage_from_handle, inputs.radius, &run.frame))
    return CopyPoints(in, out);
  ForRanges(parallel, count_, kSculptGrain, [&](std::size_t begin, std::size_t end) {
    HWY_DYNAMIC_DISPATCH(SculptLanes)(run, in, out, begin, end);
  });
}

}  // namespace kpsa::engine
#endif  // HWY_ONCE
