#include "kpsa/tiles.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kpsa/tiles.cpp"
#include "hwy/foreach_target.h"
#include "base/simd-inl.h"

#ifndef KPSA_TILES_CONSTANTS
#define KPSA_TILES_CONSTANTS
namespace kpsa {
namespace {
constexpr std::size_t kVPanelRows = 96;  // rows of V in a panel, whatever the number of components
}  // namespace
}  // namespace kpsa
#endif

HWY_BEFORE_NAMESPACE();
namespace kpsa {
namespace HWY_NAMESPACE {

template <class D>
HWY_INLINE hn::Vec<D> LoadNumbers(D d, const std::uint16_t* halfs) {
  const hn::Rebind<hwy::float16_t, D> dh;
  return hn::PromoteTo(d, hn::Load(dh, reinterpret_cast<const hwy::float16_t*>(halfs)));
}
template <class D>
HWY_INLINE hn::Vec<D> LoadNumbers(D d, const float* floats) {
  return hn::Load(d, floats);
}

// kVectors vectors of rows of a panel [columns][kRows], times kFrames inputs (input_stride apart): sums in registers,
// one fused multiply-add a column and row, in the order of the columns.
template <std::size_t kRows, int kVectors, int kFrames, typename T, class V>
HWY_INLINE void SumColumns(const T* HWY_RESTRICT panel, std::size_t columns, const float* HWY_RESTRICT input,
                           std::size_t input_stride, V (&sum)[kFrames][kVectors]) {
  const hn::ScalableTag<float> d;
  const std::size_t lanes = hn::Lanes(d);
#pragma GCC unroll 8
  for (int f = 0; f < kFrames; ++f) {
#pragma GCC unroll 24
    for (int v = 0; v < kVectors; ++v) sum[f][v] = hn::Zero(d);
  }
  for (std::size_t k = 0; k < columns; ++k, panel += kRows) {
    V factor[kFrames];
#pragma GCC unroll 8
    for (int f = 0; f < kFrames; ++f) factor[f] = hn::Set(d, input[static_cast<std::size_t>(f) * input_stride + k]);
#pragma GCC unroll 24
    for (int v = 0; v < kVectors; ++v) {
      const V numbers = LoadNumbers(d, panel + static_cast<std::size_t>(v) * lanes);
#pragma GCC unroll 8
      for (int f = 0; f < kFrames; ++f) sum[f][v] = Fma(numbers, factor[f], sum[f][v]);
    }
  }
}

// How many vectors of rows fit the registers of the target.
template <std::size_t kRows, int kFrames>
constexpr int VectorsAtOnce() {
  constexpr std::size_t kAll = kRows / HWY_LANES(float);
  constexpr std::size_t kBudget = HWY_LANES(float) >= 16 ? 24 : 12;
  return static_cast<int>(kAll * kFrames <= kBudget ? kAll : kAll % (kBudget / kFrames) == 0 ? kBudget / kFrames : 1);
}

// A panel of V: z = scale * (V w).
template <int kFrames>
HWY_INLINE void VPanel(const std::uint16_t* panel, std::size_t columns, const float* w, std::size_t w_stride,
                       const float* scale, float* z, std::size_t z_stride) {
  const hn::ScalableTag<float> d;
  const std::size_t lanes = hn::Lanes(d);
  constexpr int kVectors = VectorsAtOnce<kVPanelRows, kFrames>();
  for (std::size_t row = 0; row < kVPanelRows; row += kVectors * lanes) {
    hn::Vec<decltype(d)> sum[kFrames][kVectors];
    SumColumns<kVPanelRows>(panel + row, columns, w, w_stride, sum);
    for (int f = 0; f < kFrames; ++f) {
      for (int v = 0; v < kVectors; ++v) {
        const std::size_t at = row + static_cast<std::size_t>(v) * lanes;
        hn::StoreU(hn::Mul(sum[f][v], hn::Load(d, scale + at)), d, z + static_cast<std::size_t>(f) * z_stride + at);
      }
    }
  }
}

// A panel of points: x = mean + U z, written to the component arrays of each frame.
template <int kComponents, int kFrames, typename T>
HWY_INLINE void PointPanel(const T* panel, std::size_t columns, const float* z, std::size_t z_stride, const float* mean,
                           std::size_t first, std::size_t padded, const PointsView* outs) {
  const hn::ScalableTag<float> d;
  const std::size_t lanes = hn::Lanes(d);
  constexpr std::size_t kRows = kPanelPoints * kComponents;
  constexpr int kVectors = VectorsAtOnce<kRows, kFrames>();
  for (std::size_t row = 0; row < kRows; row += kVectors * lanes) {
    hn::Vec<decltype(d)> sum[kFrames][kVectors];
    SumColumns<kRows>(panel + row, columns, z, z_stride, sum);
    for (int f = 0; f < kFrames; ++f) {
      float* const components[3] = {outs[f].x, outs[f].y, outs[f].z};
#pragma GCC unroll 24
      for (int v = 0; v < kVectors; ++v) {
        const std::size_t at = row + static_cast<std::size_t>(v) * lanes;
        const std::size_t point = first + at % kPanelPoints;
        if (point >= padded) continue;
        hn::Store(hn::Add(hn::Load(d, mean + at), sum[f][v]), d, components[at / kPanelPoints] + point);
      }
    }
  }
}

void VPanels(const std::uint16_t* panel, std::size_t columns, const float* w, std::size_t frames, const float* scale,
             float* z, std::size_t z_stride) {
  std::size_t f = 0;
  for (; f + kBlockFrames <= frames; f += kBlockFrames) {
    VPanel<kBlockFrames>(panel, columns, w + f * columns, columns, scale, z + f * z_stride, z_stride);
  }
  for (; f < frames; ++f) VPanel<1>(panel, columns, w + f * columns, columns, scale, z + f * z_stride, z_stride);
}

template <int kComponents>
HWY_INLINE void TilePanels(const std::uint16_t* panels, std::size_t count, std::size_t columns, const float* z,
                           std::size_t z_stride, std::size_t frames, const float* mean, std::size_t first, const PointsView* outs) {
  const std::size_t padded = PaddedCount(outs[0].count);
  constexpr std::size_t kRows = kPanelPoints * kComponents;
  for (std::size_t p = 0; p < count; ++p) {
    std::size_t f = 0;
    for (; f + kBlockFrames <= frames; f += kBlockFrames) {
      PointPanel<kComponents, kBlockFrames>(panels, columns, z + f * z_stride, z_stride, mean, first, padded, outs + f);
    }
    for (; f < frames; ++f) {
      PointPanel<kComponents, 1>(panels, columns, z + f * z_stride, z_stride, mean, first, padded, outs + f);
    }
    panels += columns * kRows;
    mean += kRows;
    first += kPanelPoints;
  }
}

void TilePanels3(const std::uint16_t* panels, std::size_t count, std::size_t columns, const float* z, std::size_t z_stride,
                 std::size_t frames, const float* mean, std::size_t first, const PointsView* outs) {
  TilePanels<3>(panels, count, columns, z, z_stride, frames, mean, first, outs);
}
void TilePanels1(const std::uint16_t* panels, std::size_t count, std::size_t columns, const float* z, std::size_t z_stride,
                 std::size_t frames, const float* mean, std::size_t first, const PointsView* outs) {
  TilePanels<1>(panels, count, columns, z, z_stride, frames, mean, first, outs);
}

void DensePanels(const float* panels, std::size_t columns, const float* w, int components, const float* mean, const PointsView& out) {
  const std::size_t rows = kPanelPoints * static_cast<std::size_t>(components), padded = PaddedCount(out.count);
  for (std::size_t first = 0; first < out.count; first += kPanelPoints) {
    if (components == 3) {
      PointPanel<3, 1>(panels, columns, w, 0, mean, first, padded, &out);
    } else {
      PointPanel<1, 1>(panels, columns, w, 0, mean, first, padded, &out);
    }
    panels += columns * rows;
    mean += rows;
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kpsa
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include <algorithm>
#include <cmath>
#include <cstring>

#include "base/check.h"

namespace kpsa {

HWY_EXPORT(VPanels);
HWY_EXPORT(TilePanels3);
HWY_EXPORT(TilePanels1);
HWY_EXPORT(DensePanels);

namespace {

std::size_t Panels(std::size_t points) { return (points + kPanelPoints - 1) / kPanelPoints; }
std::size_t TilePanelCount(std::size_t points, std::size_t tile) {
  return Panels(std::min(kTilePoints, points - tile * kTilePoints));
}
bool IsPowerOfTwo(float value) {
  int exponent;
  return std::isfinite(value) && value > 0 && std::frexp(value, &exponent) == 0.5f;
}

}  // namespace

Result<TileMap> TileMap::Make(TileData data, const std::string& what) {
  TileMap map;
  const std::size_t tiles = (data.points + kTilePoints - 1) / kTilePoints;
  if (data.components != 1 && data.components != 3) return Status::Invalid("{}: {} components, expected 1 or 3", what, data.components);
  const std::size_t rows = kPanelPoints * static_cast<std::size_t>(data.components);
  if (data.ranks.size() != tiles || data.direct.size() != tiles) {
    return Status::Invalid("{}: {} ranks and {} flags for {} tiles", what, data.ranks.size(), data.direct.size(), tiles);
  }
  std::size_t v_rows = 0, direct_rows = 0, u_size = 0;
  for (std::size_t t = 0; t < tiles; ++t) {
    const std::size_t rank = data.ranks[t];
    if (rank > data.inputs || data.direct[t] > 1 || (data.direct[t] == 1 && rank != data.inputs)) {
      return Status::Invalid("{}: tile {} has rank {}, expected at most {}", what, t, rank, data.inputs);
    }
    map.v_begin_.push_back(v_rows);
    map.z_begin_.push_back(data.direct[t] == 1 ? direct_rows : v_rows);
    map.u_begin_.push_back(u_size);
    (data.direct[t] == 1 ? direct_rows : v_rows) += rank;
    u_size += TilePanelCount(data.points, t) * rank * rows;
  }
  const std::size_t v_panels = (v_rows + kVPanelRows - 1) / kVPanelRows;
  map.v_rows_ = v_panels * kVPanelRows;
  map.z_count_ = map.v_rows_ + direct_rows;
  for (std::size_t t = 0; t < tiles; ++t) {
    if (data.direct[t] == 1) map.z_begin_[t] += map.v_rows_;
  }
  if (data.v.size() != map.v_rows_ * data.inputs || data.u.size() != u_size ||
      data.mean.size() != Panels(data.points) * rows || data.scale.size() != map.z_count_) {
    return Status::Invalid("{}: arrays of {}, {}, {}, {} values, expected {}, {}, {}, {}", what, data.v.size(), data.u.size(),
                           data.mean.size(), data.scale.size(), map.v_rows_ * data.inputs, u_size,
                           Panels(data.points) * rows, map.z_count_);
  }
  for (const float scale : data.scale.span()) {
    if (!IsPowerOfTwo(scale)) return Status::Invalid("{}: a scale is {}, expected a power of two", what, scale);
  }
  map.data_ = std::move(data);
  return map;
}

std::size_t TileMap::bytes() const {
  return 2 * (data_.v.size() + data_.u.size()) + 4 * (data_.mean.size() + data_.scale.size());
}
double TileMap::numbers_per_point() const {
  return data_.points == 0 ? 0 : static_cast<double>(data_.v.size() + data_.u.size()) / static_cast<double>(data_.points);
}
double TileMap::mean_rank() const {
  double sum = 0;
  for (const std::uint32_t rank : data_.ranks) sum += rank;
  return data_.ranks.empty() ? 0 : sum / static_cast<double>(data_.ranks.size());
}
std::size_t TileMap::scratch_floats(std::size_t frames) const { return frames * ((z_count_ + 15) / 16 * 16); }

void TileMap::Run(const float* w, std::size_t frames, const Index* tiles, std::size_t tile_count, float* scratch,
                  const PointsView* outs) const {
  const std::size_t z_stride = (z_count_ + 15) / 16 * 16, inputs = data_.inputs;
  const std::size_t rows = kPanelPoints * static_cast<std::size_t>(data_.components);
  const auto v_panels = HWY_DYNAMIC_DISPATCH(VPanels);
  const auto tile_panels = data_.components == 3 ? HWY_DYNAMIC_DISPATCH(TilePanels3) : HWY_DYNAMIC_DISPATCH(TilePanels1);

  // First all of z, so that V and U are each read front to back
  std::size_t next_panel = 0;
  for (std::size_t i = 0; i < tile_count; ++i) {
    const std::size_t tile = tiles == nullptr ? i : tiles[i];
    const std::size_t rank = data_.ranks[tile];
    if (rank == 0) continue;
    if (data_.direct[tile] == 1) {
      for (std::size_t f = 0; f < frames; ++f) {
        const float* scale = data_.scale.data() + z_begin_[tile];
        float* z = scratch + f * z_stride + z_begin_[tile];
        for (std::size_t k = 0; k < rank; ++k) z[k] = w[f * inputs + k] * scale[k];
      }
      continue;
    }
    const std::size_t last = (v_begin_[tile] + rank - 1) / kVPanelRows;
    for (std::size_t panel = std::max(next_panel, v_begin_[tile] / kVPanelRows); panel <= last; ++panel) {
      v_panels(data_.v.data() + panel * inputs * kVPanelRows, inputs, w, frames, data_.scale.data() + panel * kVPanelRows,
               scratch + panel * kVPanelRows, z_stride);
      next_panel = panel + 1;
    }
  }
  for (std::size_t i = 0; i < tile_count; ++i) {
    const std::size_t tile = tiles == nullptr ? i : tiles[i];
    tile_panels(data_.u.data() + u_begin_[tile], TilePanelCount(data_.points, tile), data_.ranks[tile], scratch + z_begin_[tile],
                z_stride, frames, data_.mean.data() + tile * (kTilePoints / kPanelPoints) * rows, tile * kTilePoints, outs);
  }
}

void TileMap::Reconstruct(std::span<const float> w, std::span<float> scratch, PointsView out) const {
  ReconstructBlock(w, {&out, 1}, {}, scratch);
}

void TileMap::ReconstructTiles(std::span<const float> w, std::span<const Index> tiles, std::span<float> scratch, PointsView out) const {
  if (!tiles.empty()) ReconstructBlock(w, {&out, 1}, tiles, scratch);
}

void TileMap::ReconstructBlock(std::span<const float> w, std::span<const PointsView> outs, std::span<const Index> tiles,
                               std::span<float> scratch) const {
  if (outs.empty()) return;
  KPSA_CHECK_LE(outs.size() * data_.inputs, w.size());
  KPSA_CHECK_LE(scratch_floats(outs.size()), scratch.size());
  for (const PointsView& out : outs) KPSA_CHECK_EQ(out.count, data_.points);
  for (std::size_t i = 0; i < tiles.size(); ++i) KPSA_CHECK(tiles[i] < this->tiles() && (i == 0 || tiles[i - 1] < tiles[i]));
  Run(w.data(), outs.size(), tiles.empty() ? nullptr : tiles.data(), tiles.empty() ? this->tiles() : tiles.size(),
      scratch.data(), outs.data());
}

DenseMap::DenseMap(const Eigen::MatrixXd& gain, const Eigen::VectorXd& mean, int components)
    : points_(static_cast<std::size_t>(gain.rows() / components)),
      inputs_(static_cast<std::size_t>(gain.cols())),
      components_(components) {
  const auto c = static_cast<std::size_t>(components);
  const std::size_t rows = kPanelPoints * c;
  matrix_ = AlignedArray<float>(Panels(points_) * inputs_ * rows);
  mean_ = AlignedArray<float>(Panels(points_) * rows);
  for (std::size_t i = 0; i < points_; ++i) {
    const std::size_t panel = i / kPanelPoints;
    for (std::size_t x = 0; x < c; ++x) {
      const auto row = static_cast<Eigen::Index>(i * c + x);
      const std::size_t at = x * kPanelPoints + i % kPanelPoints;
      mean_.data()[panel * rows + at] = static_cast<float>(mean[row]);
      for (std::size_t k = 0; k < inputs_; ++k) {
        matrix_.data()[(panel * inputs_ + k) * rows + at] = static_cast<float>(gain(row, static_cast<Eigen::Index>(k)));
      }
    }
  }
}

void DenseMap::Reconstruct(std::span<const float> w, PointsView out) const {
  KPSA_CHECK_EQ(out.count, points_);
  KPSA_CHECK_LE(inputs_, w.size());
  HWY_DYNAMIC_DISPATCH(DensePanels)(matrix_.data(), inputs_, w.data(), components_, mean_.data(), out);
}

}  // namespace kpsa
#endif  // HWY_ONCE
