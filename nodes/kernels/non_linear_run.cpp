#include "nodes/kernels/non_linear_run.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/kernels/non_linear_run.cpp"
#include "hwy/foreach_target.h"

#include "nodes/kernels/handle_frame-inl.h"
#include "nodes/kernels/sine-inl.h"

HWY_BEFORE_NAMESPACE();
namespace kpsa::engine {
namespace HWY_NAMESPACE {

// Comparisons, not Min and Max, by which targets disagree about what is not a number.
HWY_INLINE VLanes Between(VLanes value, float low, float high) {
  const DLanes d;
  const VLanes least = hn::Set(d, low), most = hn::Set(d, high);
  const VLanes below_most = hn::IfThenElse(hn::Gt(value, most), most, value);
  return hn::IfThenElse(hn::Lt(value, least), least, below_most);
}
HWY_INLINE VLanes Along(const AlongRun& along, VLanes value) {
  const DLanes d;
  const VLanes low = hn::Set(d, along.low);
  const VLanes t = hn::Mul(hn::Sub(value, low), hn::Set(d, along.inverse));
  const VLanes to_end = hn::IfThenElse(hn::Ge(value, hn::Set(d, along.top)), hn::Set(d, 1.0f), t);
  return hn::IfThenZeroElse(hn::Lt(value, low), to_end);
}
HWY_INLINE VLanes Ripple(const RippleRun& ripple, VLanes at, VLanes r) {
  const DLanes d;
  const VLanes h = Fma(at, hn::Set(d, ripple.half_turns), hn::Set(d, ripple.shift));
  return hn::Mul(SinHalfTurns(h), Fma(r, hn::Set(d, ripple.fade), hn::Set(d, ripple.amplitude)));
}

// Each map turns a point q of the handle's space into f(q) - q: small moves have as many digits as large ones.

HWY_INLINE void Move(const BendRun& bend, VLanes* x, VLanes* y, VLanes* z) {
  const DLanes d;
  const VLanes at = Between(*y, bend.low, bend.high), beyond = hn::Sub(*y, at);
  const VLanes angle = hn::Mul(at, hn::Set(d, bend.curvature)), q = hn::Mul(angle, angle);
  // Of angles below 1: (sin a - a) / a and (1 - cos a) / a; the least largest errors, 4e-9
  VLanes shortening = Fma(q, hn::Set(d, 2.706086661419249e-06f), hn::Set(d, -0.00019838177831843495f));
  shortening =
      Fma(q, Fma(q, shortening, hn::Set(d, 0.008333327248692513f)), hn::Set(d, -0.1666666716337204f));
  shortening = hn::Mul(q, shortening);
  VLanes slope = Fma(q, hn::Set(d, -2.4256401957245544e-05f), hn::Set(d, 0.0013885494554415345f));
  slope = Fma(q, Fma(q, slope, hn::Set(d, -0.04166659712791443f)), hn::Set(d, 0.5f));
  slope = hn::Mul(angle, slope);
  // Of others
  const VLanes radius = hn::Set(d, bend.radius), half_turns = hn::Mul(at, hn::Set(d, bend.half_turns));
  const VLanes wide_sine = SinHalfTurns(half_turns), wide_versine = VersineHalfTurns(half_turns);

  const auto small = hn::Lt(q, hn::Set(d, 1.0f));
  const VLanes sine = hn::IfThenElse(small, Fma(angle, shortening, angle), wide_sine);
  const VLanes versine = hn::IfThenElse(small, hn::Mul(angle, slope), wide_versine);
  const VLanes arc_x = hn::IfThenElse(small, hn::Mul(at, slope), hn::Mul(wide_versine, radius));
  const VLanes arc_y = hn::IfThenElse(small, hn::Mul(at, shortening), Fma(wide_sine, radius, hn::Neg(at)));
  const VLanes move_y = hn::Sub(arc_y, Fma(*x, sine, hn::Mul(beyond, versine)));
  *x = hn::Add(arc_x, Fma(beyond, sine, hn::Neg(hn::Mul(*x, versine))));
  *y = move_y;
  *z = hn::Zero(d);
}

HWY_INLINE void Move(const TwistRun& twist, VLanes* x, VLanes* y, VLanes* z) {
  const DLanes d;
  const VLanes h = Fma(Along(twist.along, *y), hn::Set(d, twist.span), hn::Set(d, twist.start));
  const VLanes sine = SinHalfTurns(h), versine = VersineHalfTurns(h);
  const VLanes move_x = Fma(*z, sine, hn::Neg(hn::Mul(*x, versine)));
  *z = hn::Neg(Fma(*x, sine, hn::Mul(*z, versine)));
  *x = move_x;
  *y = hn::Zero(d);
}

HWY_INLINE void Move(const SquashRun& squash, VLanes* x, VLanes* y, VLanes* z) {
  const DLanes d;
  const VLanes one = hn::Set(d, 1.0f), two = hn::Set(d, 2.0f), three = hn::Set(d, 3.0f);
  const VLanes at = Between(*y, squash.low, squash.high), t = Along(squash.along, at);
  const auto first = hn::Lt(t, hn::Set(d, squash.middle));
  const auto of_half = [&](const float* halves) HWY_ATTR {
    return hn::IfThenElse(first, hn::Set(d, halves[0]), hn::Set(d, halves[1]));
  };
  const VLanes u =
      Fma(hn::IfThenElse(first, t, hn::Sub(one, t)), of_half(squash.scale), of_half(squash.bias));
  const VLanes round = hn::Mul(u, hn::Sub(two, u));
  const VLanes smooth = hn::Mul(hn::Mul(u, u), hn::Sub(three, hn::Add(u, u)));
  const VLanes bump = Fma(of_half(squash.smoothness), hn::Sub(smooth, round), round);
  const VLanes scale = hn::Mul(hn::Set(d, squash.widening), bump);
  *x = hn::Mul(*x, scale);
  *y = hn::Mul(at, hn::Set(d, squash.stretch));
  *z = hn::Mul(*z, scale);
}

HWY_INLINE void Move(const FlareRun& flare, VLanes* x, VLanes* y, VLanes* z) {
  const DLanes d;
  const VLanes t = Along(flare.along, *y);
  const VLanes bulge = hn::Mul(hn::Set(d, flare.bulge), hn::Mul(t, hn::Sub(hn::Set(d, 1.0f), t)));
  const auto scale = [&](float start, float change)
                         HWY_ATTR { return hn::Add(Fma(t, hn::Set(d, change), hn::Set(d, start)), bulge); };
  *x = hn::Mul(*x, scale(flare.start_x, flare.change_x));
  *y = hn::Zero(d);
  *z = hn::Mul(*z, scale(flare.start_z, flare.change_z));
}

HWY_INLINE void Move(const SineRun& sine, VLanes* x, VLanes* y, VLanes* z) {
  const DLanes d;
  const VLanes at = Between(*y, sine.low, sine.high);
  const auto below = hn::Lt(at, hn::Zero(d));
  const VLanes scale = hn::IfThenElse(below, hn::Set(d, sine.below_scale), hn::Set(d, sine.above_scale));
  const VLanes bias = hn::IfThenElse(below, hn::Set(d, sine.below_bias), hn::Set(d, sine.above_bias));
  *x = Ripple(sine.ripple, at, Fma(at, scale, bias));
  *y = *z = hn::Zero(d);
}

HWY_INLINE void Move(const WaveRun& wave, VLanes* x, VLanes* y, VLanes* z) {
  const DLanes d;
  const VLanes distance = hn::Sqrt(Fma(*x, *x, hn::Mul(*z, *z)));
  const VLanes at = Between(distance, wave.low, wave.high);
  *y = Ripple(wave.ripple, at, Along(wave.along, at));
  *x = *z = hn::Zero(d);
}

template <typename Map>
HWY_INLINE void Deform(const Map& map, const NonLinearRun& run, ConstPointsView in, PointsView out,
                       std::size_t begin, std::size_t end) {
  MoveInFrame(run.frame, run.weights, run.envelope, in, out, begin, end,
              [&](VLanes* x, VLanes* y, VLanes* z) HWY_ATTR { Move(map, x, y, z); });
}

void NonLinearLanes(const NonLinearRun& run, ConstPointsView in, PointsView out, std::size_t begin,
                    std::size_t end) {
  switch (run.kind) {
    case 0:
      return Deform(run.bend, run, in, out, begin, end);
    case 1:
      return Deform(run.twist, run, in, out, begin, end);
    case 2:
      return Deform(run.squash, run, in, out, begin, end);
    case 3:
      return Deform(run.flare, run, in, out, begin, end);
    case 4:
      return Deform(run.sine, run, in, out, begin, end);
    default:
      return Deform(run.wave, run, in, out, begin, end);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kpsa::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace kpsa::engine {

HWY_EXPORT(NonLinearLanes);

void RunNonLinear(const NonLinearRun& run, ConstPointsView in, PointsView out, std::size_t begin,
                  std::size_t end) noexcept {
  HWY_DYNAMIC_DISPATCH(NonLinearLanes)(run, in, out, begin, end);
}

}  // namespace kpsa::engine
#endif  // HWY_ONCE
