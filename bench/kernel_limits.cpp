#include "bench/kernel_limits.h"

#include <algorithm>
#include <chrono>

#include "base/points.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bench/kernel_limits.cpp"
#include "hwy/foreach_target.h"

#include "base/simd-inl.h"

HWY_BEFORE_NAMESPACE();
namespace kpsa::engine {
namespace HWY_NAMESPACE {

using DLimits = hn::CappedTag<float, 16>;

void Triad(const float* b, const float* c, std::size_t count, float* a) {
  const DLimits d;
  const auto s = hn::Set(d, 0.5f);
  for (std::size_t i = 0; i < count; i += hn::Lanes(d))
    hn::Store(Fma(s, hn::Load(d, c + i), hn::Load(d, b + i)), d, a + i);
}

// Gives the number of operations; `sink` keeps them from being left out.
std::size_t MultiplyAdd(std::size_t rounds, float* sink) {
  const DLimits d;
  const auto x = hn::Set(d, sink[0]), y = hn::Set(d, sink[1]);
  auto a0 = x, a1 = y, a2 = x, a3 = y, a4 = x, a5 = y, a6 = x, a7 = y, a8 = x, a9 = y;
  for (std::size_t i = 0; i < rounds; ++i) {
    a0 = Fma(a0, x, y), a1 = Fma(a1, x, y), a2 = Fma(a2, x, y), a3 = Fma(a3, x, y), a4 = Fma(a4, x, y);
    a5 = Fma(a5, x, y), a6 = Fma(a6, x, y), a7 = Fma(a7, x, y), a8 = Fma(a8, x, y), a9 = Fma(a9, x, y);
  }
  const auto sum = hn::Add(hn::Add(hn::Add(a0, a1), hn::Add(a2, a3)),
                           hn::Add(hn::Add(hn::Add(a4, a5), hn::Add(a6, a7)), hn::Add(a8, a9)));
  sink[2] = hn::GetLane(sum);
  return rounds * 10 * 2 * hn::Lanes(d);
}

}  // namespace HWY_NAMESPACE
}  // namespace kpsa::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace kpsa::engine {

HWY_EXPORT(Triad);
HWY_EXPORT(MultiplyAdd);

namespace {
// The least time of many runs.
template <typename F>
double Nanoseconds(int runs, F run) {
  using Clock = std::chrono::steady_clock;
  double best = 1e30;
  for (int i = 0; i < runs; ++i) {
    const auto before = Clock::now();
    run();
    best = std::min(best, std::chrono::duration<double, std::nano>(Clock::now() - before).count());
  }
  return best;
}
}  // namespace

double BytesANanosecond(std::size_t bytes) {
  const std::size_t count = std::max<std::size_t>(bytes / 12 / 16 * 16, 256);
  // Repeated where there is little: a clock has no digits for less
  const std::size_t repeats = std::max<std::size_t>(1, 20000 / count);
  AlignedFloats a(count), b(count), c(count);
  const double ns = Nanoseconds(60, [&] {
    for (std::size_t i = 0; i < repeats; ++i)
      HWY_DYNAMIC_DISPATCH(Triad)(b.data(), c.data(), count, a.data());
  });
  return 12 * static_cast<double>(count * repeats) / ns;
}

double OperationsANanosecond() {
  float sink[3] = {0.5f, 0.25f, 0};
  std::size_t operations = 0;
  const double ns = Nanoseconds(200, [&] { operations = HWY_DYNAMIC_DISPATCH(MultiplyAdd)(10000, sink); });
  return static_cast<double>(operations) / ns;
}

}  // namespace kpsa::engine
#endif  // HWY_ONCE
