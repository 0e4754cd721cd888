#include "nodes/kernels/carried_delta.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/kernels/carried_delta.cpp"
#include "hwy/foreach_target.h"

#include "nodes/kernels/affine-inl.h"

HWY_BEFORE_NAMESPACE();
namespace kpsa::engine {
namespace HWY_NAMESPACE {

// As floats, and in double again; what is not finite is 0.
HWY_INLINE Four StorePivot(Four pivot, float* to) {
  const Four finite = (pivot - pivot) == 0 ? pivot : Four{};
  const FourFloats floats = __builtin_convertvector(finite, FourFloats);
  std::memcpy(to, &floats, sizeof(floats));
  return __builtin_convertvector(floats, Four);
}

// linear: columns of M; offset: M pivot - pivot.
HWY_INLINE void StoreDelta(const Four (&linear)[3], Four offset, AffineDelta* delta) {
  const Four moves[4] = {linear[0] - Four{1, 0, 0, 0}, linear[1] - Four{0, 1, 0, 0},
                         linear[2] - Four{0, 0, 1, 0}, offset};
  for (std::size_t c = 0; c < 3; ++c) StoreFour(moves[c], delta->linear + 4 * c);
  StoreFour(offset, delta->offset);
  const auto moved = (moves[0] != 0) | (moves[1] != 0) | (moves[2] != 0) | (moves[3] != 0);
  delta->is_zero = (moved[0] | moved[1] | moved[2]) == 0;
}

// ahead parent^-1 about a pivot of the parent; false, and ahead, where there is no inverse.
HWY_INLINE bool Behind(const FourColumns& ahead, const FourColumns& parent, Double3 pivot_in_parent,
                       AffineDelta* HWY_RESTRICT delta) {
  Four rows[3];
  const bool regular = InverseRows(parent, rows);
  alignas(32) double inverse[12];  // row by row
  for (std::size_t r = 0; r < 3; ++r) StoreFour(rows[r], inverse + 4 * r);
  Four linear[3];
  for (std::size_t c = 0; c < 3; ++c)
    linear[c] = ahead.c[0] * inverse[c] + ahead.c[1] * inverse[4 + c] + ahead.c[2] * inverse[8 + c];

  // M p = linear (p - the parent's place) + ahead's place
  const double pivot[3] = {pivot_in_parent.x, pivot_in_parent.y, pivot_in_parent.z};
  alignas(32) double arm[4];
  const Four about = StorePivot(Placed(parent, pivot), delta->pivot);
  StoreFour(regular ? about - parent.c[3] : about, arm);
  const Four place = linear[0] * arm[0] + linear[1] * arm[1] + linear[2] * arm[2];
  StoreDelta(linear, place + (ahead.c[3] - about), delta);
  return regular;
}

void CarriedLanes(const Matrix4& handle, const Matrix4& parent, const CarriedRest& rest, AffineDelta* delta) {
  Behind(Product(LoadColumns(handle), rest.after.m.data()), LoadColumns(parent), rest.pivot, delta);
}

bool ParentLanes(const Matrix4& parent, const ParentRest& rest, ParentMotion* motion) {
  const FourColumns now = LoadColumns(parent);
  for (std::size_t c = 0; c < 3; ++c) StoreFour(Turned(now, &rest.inverse.m[4 * c]), motion->linear + 4 * c);
  return Behind(LoadColumns(rest.parent), now, rest.pivot, &motion->to_rest);
}

// parent^-1 m
HWY_INLINE FourColumns Against(const Matrix4& parent, const FourColumns& m) {
  const FourColumns of_parent = LoadColumns(parent);
  Four rows[3];
  const bool regular = InverseRows(of_parent, rows);
  const FourColumns inverse = {{Four{rows[0][0], rows[1][0], rows[2][0], 0},
                                Four{rows[0][1], rows[1][1], rows[2][1], 0},
                                Four{rows[0][2], rows[1][2], rows[2][2], 0}, Four{}}};
  alignas(32) double columns[16];
  for (std::size_t c = 0; c < 3; ++c) StoreFour(m.c[c], columns + 4 * c);
  StoreFour(regular ? m.c[3] - of_parent.c[3] : m.c[3], columns + 12);
  return Product(inverse, columns);
}

// before (parent^-1 m)
HWY_INLINE FourColumns Waiting(const Matrix4& before, const Matrix4& parent, const FourColumns& m) {
  const FourColumns own = Against(parent, m);
  alignas(32) double columns[16];
  for (std::size_t c = 0; c < 4; ++c) StoreFour(own.c[c], columns + 4 * c);
  return Product(LoadColumns(before), columns);
}

void WaitingDeltaLanes(const Matrix4& handle, const Matrix4& parent, const WaitingRest& rest,
                       AffineDelta* HWY_RESTRICT delta) {
  const FourColumns m = Waiting(rest.before, parent, Product(LoadColumns(handle), rest.after.m.data()));
  alignas(32) double pivot[4];
  const Four about = StorePivot(FourOf(rest.pivot), delta->pivot);
  StoreFour(about, pivot);
  StoreDelta({m.c[0], m.c[1], m.c[2]}, Placed(m, pivot) - about, delta);
}

HWY_INLINE void StoreAffine(const FourColumns& m, Matrix4* HWY_RESTRICT to) {
  for (std::size_t c = 0; c < 3; ++c) StoreFour(Four{m.c[c][0], m.c[c][1], m.c[c][2], 0}, &to->m[4 * c]);
  StoreFour(Four{m.c[3][0], m.c[3][1], m.c[3][2], 1}, &to->m[12]);
}
void WaitingFrameLanes(const Matrix4& before, const Matrix4& parent, const Matrix4& handle, Matrix4* frame) {
  StoreAffine(Waiting(before, parent, LoadColumns(handle)), frame);
}
void ProductLanes(const Matrix4& a, const Matrix4& b, Matrix4* product) {
  StoreAffine(Product(LoadColumns(a), b.m.data()), product);
}

}  // namespace HWY_NAMESPACE
}  // namespace kpsa::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace kpsa::engine {

HWY_EXPORT(CarriedLanes);
HWY_EXPORT(ParentLanes);
HWY_EXPORT(WaitingDeltaLanes);
HWY_EXPORT(WaitingFrameLanes);
HWY_EXPORT(ProductLanes);

void FindCarriedDelta(const Matrix4& handle, const Matrix4& parent, const CarriedRest& rest,
                      AffineDelta* delta) noexcept {
  HWY_DYNAMIC_DISPATCH(CarriedLanes)(handle, parent, rest, delta);
}
bool FindParentMotion(const Matrix4& parent, const ParentRest& rest, ParentMotion* motion) noexcept {
  return HWY_DYNAMIC_DISPATCH(ParentLanes)(parent, rest, motion);
}
void FindWaitingDelta(const Matrix4& handle, const Matrix4& parent, const WaitingRest& rest,
                      AffineDelta* delta) noexcept {
  HWY_DYNAMIC_DISPATCH(WaitingDeltaLanes)(handle, parent, rest, delta);
}
void FindWaitingFrame(const Matrix4& before, const Matrix4& parent, const Matrix4& handle,
                      Matrix4* frame) noexcept {
  HWY_DYNAMIC_DISPATCH(WaitingFrameLanes)(before, parent, handle, frame);
}

void FindProduct(const Matrix4& a, const Matrix4& b, Matrix4* product) noexcept {
  HWY_DYNAMIC_DISPATCH(ProductLanes)(a, b, product);
}

}  // namespace kpsa::engine
#endif  // HWY_ONCE
