#include "nodes/kernels/handle_frame.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/kernels/handle_frame.cpp"
#include "hwy/foreach_target.h"

#include "nodes/kernels/affine-inl.h"

HWY_BEFORE_NAMESPACE();
namespace kpsa::engine {
namespace HWY_NAMESPACE {

bool HandleLanes(const Matrix4& matrix, double size, HandleFrame* HWY_RESTRICT frame) {
  const FourColumns m = LoadColumns(matrix);
  const double inverse_size = 1 / size;
  Four rows[3];
  if (!InverseRows(m, rows)) return false;
  FourFloats sum{};  // of zeros, or of what is not finite
  const auto round = [&](Four four, float* to) HWY_ATTR {
    const FourFloats floats = __builtin_convertvector(four, FourFloats);
    std::memcpy(to, &floats, sizeof(floats));
    sum += floats * 0.0f;
    return floats;
  };
  for (std::size_t i = 0; i < 3; ++i) {
    rows[i] *= inverse_size;
    round(rows[i], frame->inverse + 4 * i);
    round(m.c[i] * size, frame->linear + 4 * i);
  }
  const Four left = __builtin_convertvector(round(m.c[3], frame->pivot), Four) - m.c[3];
  for (std::size_t i = 0; i < 3; ++i) frame->offset[i] = static_cast<float>(FourDot(rows[i], left));
  return sum[0] == 0 && sum[1] == 0 && sum[2] == 0;
}

}  // namespace HWY_NAMESPACE
}  // namespace kpsa::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace kpsa::engine {

HWY_EXPORT(HandleLanes);

bool PrepareHandleFrame(const Matrix4& matrix, double size, HandleFrame* frame) noexcept {
  return HWY_DYNAMIC_DISPATCH(HandleLanes)(matrix, size, frame);
}

}  // namespace kpsa::engine
#endif  // HWY_ONCE
