// Points of a handle's space that go somewhere else; included once per target.
#if defined(KPSA_NODES_KERNELS_HANDLE_FRAME_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef KPSA_NODES_KERNELS_HANDLE_FRAME_INL_H_
#undef KPSA_NODES_KERNELS_HANDLE_FRAME_INL_H_
#else
#define KPSA_NODES_KERNELS_HANDLE_FRAME_INL_H_
#endif

#include "nodes/kernels/handle_frame.h"

#include "nodes/kernels/xyzw-inl.h"

HWY_BEFORE_NAMESPACE();
namespace kpsa::engine {
namespace HWY_NAMESPACE {

// out = in + w linear (f(q) - q); move(&x, &y, &z) turns q into f(q) - q. Points of weight 0 keep their bits.
template <typename Move>
HWY_INLINE void MoveInFrame(const HandleFrame& frame, const float* weights, float envelope,
                            ConstPointsView in, PointsView out, std::size_t begin, std::size_t end,
                            const Move& move) {
  const DLanes d;
  const auto row = [&](const float* m, std::size_t step, VLanes x, VLanes y, VLanes z, VLanes last) HWY_ATTR {
    return Fma(hn::Set(d, m[0]), x, Fma(hn::Set(d, m[step]), y, Fma(hn::Set(d, m[2 * step]), z, last)));
  };
  for (std::size_t i = begin; i < end; i += hn::Lanes(d)) {
    const VLanes w = hn::Mul(hn::Load(d, weights + i), hn::Set(d, envelope));
    const VLanes px = hn::Load(d, in.x + i), py = hn::Load(d, in.y + i), pz = hn::Load(d, in.z + i);
    const VLanes rx = hn::Sub(px, hn::Set(d, frame.pivot[0])), ry = hn::Sub(py, hn::Set(d, frame.pivot[1])),
                 rz = hn::Sub(pz, hn::Set(d, frame.pivot[2]));
    VLanes x = row(frame.inverse, 1, rx, ry, rz, hn::Set(d, frame.offset[0]));
    VLanes y = row(frame.inverse + 4, 1, rx, ry, rz, hn::Set(d, frame.offset[1]));
    VLanes z = row(frame.inverse + 8, 1, rx, ry, rz, hn::Set(d, frame.offset[2]));
    move(&x, &y, &z);
    const auto moves = hn::Ne(w, hn::Zero(d));
    const auto moved = [&](const float* linear, VLanes p) HWY_ATTR {
      return hn::IfThenElse(moves, Fma(w, row(linear, 4, x, y, z, hn::Zero(d)), p), p);
    };
    hn::Store(moved(frame.linear, px), d, out.x + i);
    hn::Store(moved(frame.linear + 1, py), d, out.y + i);
    hn::Store(moved(frame.linear + 2, pz), d, out.z + i);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kpsa::engine
HWY_AFTER_NAMESPACE();

#endif  // include guard
