#include "tests/kpsa/dense_map.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tests/kpsa/dense_map.cpp"
#include "hwy/foreach_target.h"

#include "base/simd-inl.h"

#ifndef KPSA_DENSE_PANEL
#define KPSA_DENSE_PANEL
namespace kpsa::engine {
namespace {
constexpr std::size_t kPanel = 32;  // points
}  // namespace
}  // namespace kpsa::engine
#endif

HWY_BEFORE_NAMESPACE();
namespace kpsa::engine {
namespace HWY_NAMESPACE {

template <int kComponents>
HWY_INLINE void DensePanel(const float* panel, std::size_t columns, const float* y, const float* mean,
                           std::size_t first, std::size_t padded, const PointsView& out) {
  const hn::ScalableTag<float> d;
  const std::size_t lanes = hn::Lanes(d);
  constexpr std::size_t kRows = kPanel * kComponents;
  constexpr std::size_t kAll = kRows / HWY_LANES(float);
  constexpr int kVectors = static_cast<int>(kAll <= 12 ? kAll : kAll % 12 == 0 ? 12 : 1);  // in registers
  float* const components[3] = {out.x, out.y, out.z};
  for (std::size_t row = 0; row < kRows; row += kVectors * lanes) {
    hn::Vec<decltype(d)> sum[kVectors];
#pragma GCC unroll 24
    for (int v = 0; v < kVectors; ++v) sum[v] = hn::Zero(d);
    for (std::size_t k = 0; k < columns; ++k) {
      const auto factor = hn::Set(d, y[k]);
#pragma GCC unroll 24
      for (int v = 0; v < kVectors; ++v) {
        sum[v] =
            Fma(hn::Load(d, panel + k * kRows + row + static_cast<std::size_t>(v) * lanes), factor, sum[v]);
      }
    }
#pragma GCC unroll 24
    for (int v = 0; v < kVectors; ++v) {
      const std::size_t at = row + static_cast<std::size_t>(v) * lanes;
      const std::size_t point = first + at % kPanel;
      if (point < padded)
        hn::Store(hn::Add(hn::Load(d, mean + at), sum[v]), d, components[at / kPanel] + point);
    }
  }
}

void DensePanels(const float* panels, std::size_t columns, const float* y, int components, const float* mean,
                 const PointsView& out) {
  const std::size_t rows = kPanel * static_cast<std::size_t>(components), padded = PaddedCount(out.count);
  for (std::size_t first = 0; first < out.count; first += kPanel) {
    if (components == 3) {
      DensePanel<3>(panels, columns, y, mean, first, padded, out);
    } else {
      DensePanel<1>(panels, columns, y, mean, first, padded, out);
    }
    panels += columns * rows;
    mean += rows;
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kpsa::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include "base/check.h"

namespace kpsa::engine {

HWY_EXPORT(DensePanels);

DenseMap::DenseMap(const Eigen::MatrixXd& gain, const Eigen::VectorXd& mean, int components)
    : points_(static_cast<std::size_t>(gain.rows() / components)),
      inputs_(static_cast<std::size_t>(gain.cols())),
      components_(components) {
  const auto c = static_cast<std::size_t>(components);
  const std::size_t rows = kPanel * c;
  matrix_ = AlignedArray<float>(((points_ + kPanel - 1) / kPanel) * inputs_ * rows);
  mean_ = AlignedArray<float>(((points_ + kPanel - 1) / kPanel) * rows);
  for (std::size_t i = 0; i < points_; ++i) {
    const std::size_t panel = i / kPanel;
    for (std::size_t x = 0; x < c; ++x) {
      const auto row = static_cast<Eigen::Index>(i * c + x);
      const std::size_t at = x * kPanel + i % kPanel;
      mean_.data()[panel * rows + at] = static_cast<float>(mean[row]);
      for (std::size_t k = 0; k < inputs_; ++k) {
        matrix_.data()[(panel * inputs_ + k) * rows + at] =
            static_cast<float>(gain(row, static_cast<Eigen::Index>(k)));
      }
    }
  }
}

void DenseMap::Reconstruct(std::span<const float> y, PointsView out) const {
  KPSA_CHECK_EQ(out.count, points_);
  KPSA_CHECK_LE(inputs_, y.size());
  HWY_DYNAMIC_DISPATCH(DensePanels)(matrix_.data(), inputs_, y.data(), components_, mean_.data(), out);
}

}  // namespace kpsa::engine
#endif  // HWY_ONCE
