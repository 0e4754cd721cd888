#include "kpsa/tiles.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kpsa/tiles.cpp"
#include "kpsa/tile_panels_vnni.h"

#include "hwy/foreach_target.h"

#include "base/simd-inl.h"

#ifndef KPSA_TILES_STEP
#define KPSA_TILES_STEP
namespace kpsa::engine {
namespace {

constexpr float kInputRange = 32639;  // 127 * 256 + 127: both bytes of a wide column's input stay in 16 bits
constexpr float kSmallestInput = 1e-30f;  // inputs below are zeros; their inverse stays finite

// The inputs of the bytes of a tile: high bytes of the wide columns, their low bytes, the narrow columns.
struct TileInput {
  alignas(64) std::int16_t q[2 * kMaxTileRank + 32];
};

}  // namespace
}  // namespace kpsa::engine
#endif

HWY_BEFORE_NAMESPACE();
namespace kpsa::engine {
namespace HWY_NAMESPACE {

// How many vectors of rows are summed in registers at a time.
template <std::size_t kRows, int kFrames, std::size_t kBudget>
constexpr int VectorsAtOnce() {
  constexpr std::size_t kAll = kRows / HWY_LANES(float);
  return static_cast<int>(kAll * kFrames <= kBudget         ? kAll
                          : kAll % (kBudget / kFrames) == 0 ? kBudget / kFrames
                                                            : 1);
}
constexpr bool kManyRegisters = HWY_LANES(float) >= 16;

// The inputs of the byte columns: q = round(t / step) of 16 bits, with the step that the largest asks for; high
// bytes of the wide columns, their low bytes, the narrow columns. t [rank, padded to 16]. Reads nothing that it
// has just written: loads that straddle stores wait for them.
void QuantizeInputs(std::size_t wide, std::size_t rank, const float* HWY_RESTRICT t,
                    std::int16_t* HWY_RESTRICT q16, TileFrame* frame) {
  const hn::CappedTag<float, 16> d;
  const hn::Rebind<std::int32_t, decltype(d)> di;
  const hn::Rebind<std::int16_t, decltype(d)> ds;
  const std::size_t lanes = hn::Lanes(d);
  const auto first = [&](std::size_t count, std::size_t k) HWY_ATTR {  // of t + k; then zeros
    return hn::IfThenElseZero(hn::FirstN(d, count - k), hn::LoadU(d, t + k));
  };
  const auto high = [&](std::size_t k) HWY_ATTR { return hn::Mul(hn::Set(d, 256.0f), first(wide, k)); };
  // As integers, magnitudes are in the order of the numbers, and NaNs and infinities come last
  const auto magnitude = hn::Set(di, 0x7fffffff);
  auto most = hn::Zero(di);
  for (std::size_t k = 0; k < rank; k += lanes)
    most = hn::Max(most, hn::And(magnitude, hn::BitCast(di, first(rank, k))));
  for (std::size_t k = 0; k < wide; k += lanes)
    most = hn::Max(most, hn::And(magnitude, hn::BitCast(di, high(k))));
  const std::int32_t bits = hn::GetLane(hn::MaxOfLanes(di, most));
  const float largest = std::bit_cast<float>(bits);
  const bool spoiled = bits >= 0x7f800000;
  frame->step = spoiled ? std::numeric_limits<float>::quiet_NaN() : largest / kInputRange;
  const auto inverse = hn::Set(d, !spoiled && largest > kSmallestInput ? kInputRange / largest : 0.0f);
  auto total = hn::Zero(di);
  const auto put = [&](hn::Vec<decltype(d)> value, std::size_t to) HWY_ATTR {
    const auto q = hn::NearestInt(hn::Mul(value, inverse));
    total = hn::Add(total, q);
    hn::StoreU(hn::DemoteTo(ds, q), ds, q16 + to);
  };
  for (std::size_t k = 0; k < wide; k += lanes) put(high(k), k);
  for (std::size_t k = 0; k < rank; k += lanes) put(first(rank, k), wide + k);
  std::memset(q16 + wide + rank, 0, 4 * sizeof(*q16));  // the rest of a group of four
  frame->bias = !spoiled ? 128 * hn::GetLane(hn::SumOfLanes(di, total)) : 0;
}

// sum + the product of pairs of signed 16-bit numbers, added for each 32-bit lane (modulo 2^32).
template <class V>
HWY_INLINE V AddPairs(V a, V b, V sum) {
#if HWY_TARGET == HWY_AVX3
  return V{_mm512_add_epi32(sum.raw, _mm512_madd_epi16(a.raw, b.raw))};
#elif HWY_TARGET == HWY_AVX2
  return V{_mm256_add_epi32(sum.raw, _mm256_madd_epi16(a.raw, b.raw))};
#else
  const auto low = [](V v) HWY_ATTR { return hn::ShiftRight<16>(hn::ShiftLeft<16>(v)); };
  const auto high = [](V v) HWY_ATTR { return hn::ShiftRight<16>(v); };
  return hn::Add(sum, hn::Add(hn::Mul(low(a), low(b)), hn::Mul(high(a), high(b))));
#endif
}

// A panel of points: x = mean + step (U q), written to the component arrays of each frame. u:
// [groups][32c][4] bytes.
template <int kComponents, int kFrames>
HWY_INLINE void PointPanel(const std::uint8_t* HWY_RESTRICT u, std::size_t groups, const TileFrame* frames,
                           const float* mean, std::size_t first, std::size_t padded) {
  const hn::ScalableTag<float> d;
  const hn::Rebind<std::int32_t, decltype(d)> di;
  using V = hn::Vec<decltype(di)>;
  const std::size_t lanes = hn::Lanes(d);
  constexpr std::size_t kRows = kPanelPoints * kComponents;
  constexpr int kVectors = VectorsAtOnce < kRows, kFrames, kManyRegisters ? 12 : 6 > ();
  const auto* numbers = reinterpret_cast<const std::int32_t*>(u);
  const V mask = hn::Set(di, 0x00ff00ff);
  for (std::size_t row = 0; row < kRows; row += kVectors * lanes) {
    V sum[kFrames][kVectors];
#pragma GCC unroll 8
    for (int f = 0; f < kFrames; ++f) {
#pragma GCC unroll 24
      for (int v = 0; v < kVectors; ++v) sum[f][v] = hn::Set(di, -frames[f].bias);
    }
    for (std::size_t g = 0; g < groups; ++g) {
      V q0[kFrames], q1[kFrames];
#pragma GCC unroll 8
      for (int f = 0; f < kFrames; ++f) {
        std::int32_t pairs[2];
        std::memcpy(pairs, frames[f].q + 4 * g, sizeof(pairs));
        q0[f] = hn::Set(di, pairs[0]);
        q1[f] = hn::Set(di, pairs[1]);
      }
#pragma GCC unroll 24
      for (int v = 0; v < kVectors; ++v) {
        const V bytes = hn::Load(di, numbers + g * kRows + row + static_cast<std::size_t>(v) * lanes);
        const V even = hn::And(bytes, mask);
        const V odd = hn::And(hn::ShiftRight<8>(bytes), mask);
#pragma GCC unroll 8
        for (int f = 0; f < kFrames; ++f) sum[f][v] = AddPairs(odd, q1[f], AddPairs(even, q0[f], sum[f][v]));
      }
    }
    for (int f = 0; f < kFrames; ++f) {
      float* const components[3] = {frames[f].out.x, frames[f].out.y, frames[f].out.z};
      const auto step = hn::Set(d, frames[f].step);
#pragma GCC unroll 24
      for (int v = 0; v < kVectors; ++v) {
        const std::size_t at = row + static_cast<std::size_t>(v) * lanes;
        const std::size_t point = first + at % kPanelPoints;
        if (point >= padded) continue;
        hn::Store(Fma(hn::ConvertTo(d, sum[f][v]), step, hn::Load(d, mean + at)), d,
                  components[at / kPanelPoints] + point);
      }
    }
  }
}

template <int kComponents>
HWY_INLINE void TilePanels(const std::uint8_t* u, std::size_t panels, std::size_t groups, const float* mean,
                           std::size_t first, const TileFrame* frames, std::size_t frame_count) {
#if HWY_TARGET == HWY_AVX3
  if (HasVnni()) return TilePanelsVnni(u, panels, groups, kComponents, mean, first, frames, frame_count);
#endif
  const std::size_t padded = PaddedCount(frames[0].out.count);
  constexpr std::size_t kRows = kPanelPoints * kComponents;
  for (std::size_t p = 0; p < panels; ++p) {
    if (frame_count == kBlockFrames) {
      PointPanel<kComponents, kBlockFrames>(u, groups, frames, mean, first, padded);
    } else {
      for (std::size_t f = 0; f < frame_count; ++f)
        PointPanel<kComponents, 1>(u, groups, frames + f, mean, first, padded);
    }
    u += 4 * groups * kRows;
    mean += kRows;
    first += kPanelPoints;
  }
  const std::size_t end = first, begin = first - panels * kPanelPoints;
  for (std::size_t f = 0; f < frame_count && kComponents == 3; ++f) {
    const PointsView& out = frames[f].out;
    if (frames[f].space != nullptr)
      TransformPoints(*frames[f].space,
                      {out.x + begin, out.y + begin, out.z + begin, std::min(end, out.count) - begin});
  }
}

void TilePanels3(const std::uint8_t* u, std::size_t panels, std::size_t groups, const float* mean,
                 std::size_t first, const TileFrame* frames, std::size_t frame_count) {
  TilePanels<3>(u, panels, groups, mean, first, frames, frame_count);
}
void TilePanels1(const std::uint8_t* u, std::size_t panels, std::size_t groups, const float* mean,
                 std::size_t first, const TileFrame* frames, std::size_t frame_count) {
  TilePanels<1>(u, panels, groups, mean, first, frames, frame_count);
}

}  // namespace HWY_NAMESPACE
}  // namespace kpsa::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include "base/check.h"
#include "base/matrix.h"
#include "kpsa/rigid_points.h"
#include "kpsa/tile_inputs.h"

namespace kpsa::engine {

HWY_EXPORT(QuantizeInputs);
HWY_EXPORT(TilePanels3);
HWY_EXPORT(TilePanels1);

namespace {

std::size_t Panels(std::size_t points) { return (points + kPanelPoints - 1) / kPanelPoints; }
std::size_t TilePanelCount(std::size_t points, std::size_t tile) {
  return Panels(std::min(kTilePoints, points - tile * kTilePoints));
}
std::size_t Padded16(std::size_t count) { return (count + 15) / 16 * 16; }
// Twelve entries, column by column.
Matrix4 MatrixOf(const float* entries) {
  Matrix4 matrix;
  for (int e = 0; e < 12; ++e) matrix(e % 3, e / 3) = static_cast<double>(entries[e]);
  return matrix;
}
constexpr std::size_t kTilesAhead = 4;  // whose inputs are computed before their points
static_assert(kTilesAhead <= kTilesAtOnce);
struct InputSpace {
  alignas(64) float t[kMaxTileRank + 16];
};
// Four byte columns each.
std::size_t Groups(std::size_t rank, std::size_t wide) { return (rank + wide + 3) / 4; }

}  // namespace

Result<TileMap> TileMap::Make(TileData data, const std::string& what, const std::optional<Digest>& known) {
  TileMap map;
  map.known_digest_ = known;
  const std::size_t tiles = (data.points + kTilePoints - 1) / kTilePoints;
  if (data.components != 1 && data.components != 3)
    return Status::Invalid("{}: {} components, expected 1 or 3", what, data.components);
  const std::size_t rows = kPanelPoints * static_cast<std::size_t>(data.components);
  if (data.ranks.size() != tiles || data.wide.size() != tiles || data.counts.size() != tiles ||
      data.direct.size() != tiles) {
    return Status::Invalid("{}: {} ranks, {} wide, {} counts and {} flags for {} tiles", what,
                           data.ranks.size(), data.wide.size(), data.counts.size(), data.direct.size(),
                           tiles);
  }
  std::size_t columns = 0, v_size = 0, u_size = 0, scales = 0;
  for (std::size_t t = 0; t < tiles; ++t) {
    const std::size_t rank = data.ranks[t], wide = data.wide[t], count = data.counts[t];
    const bool has_products = t < data.products.size() && data.products[t] > 0;  // more columns than cues
    if ((rank > count && !has_products) || rank > kMaxTileRank || count > data.inputs || wide > rank ||
        data.direct[t] > 1 || (data.direct[t] == 1 && rank != count)) {
      return Status::Invalid("{}: tile {} has rank {} ({} wide) of {} cues, expected at most {}", what, t,
                             rank, wide, count, std::min(data.inputs, kMaxTileRank));
    }
    map.column_begin_.push_back(columns);
    map.scale_begin_.push_back(scales);
    map.v_begin_.push_back(v_size);
    map.u_begin_.push_back(u_size);
    columns += count;
    scales += Padded16(rank);
    v_size += data.direct[t] == 1 ? 0 : count * Padded16(rank);
    u_size += TilePanelCount(data.points, t) * Groups(rank, wide) * 4 * rows;
  }
  if (data.columns.size() != columns || data.scale.size() != scales || data.v.size() != v_size ||
      data.u.size() != u_size || data.mean.size() != Panels(data.points) * rows) {
    return Status::Invalid("{}: arrays of {}, {}, {}, {}, {} values, expected {}, {}, {}, {}, {}", what,
                           data.columns.size(), data.scale.size(), data.v.size(), data.u.size(),
                           data.mean.size(), columns, scales, v_size, u_size, Panels(data.points) * rows);
  }
  for (const std::uint32_t column : data.columns) {
    if (column >= data.inputs)
      return Status::Invalid("{}: a tile reads cue row {} of {}", what, column, data.inputs);
  }
  if (!data.products.empty()) KPSA_RETURN_IF_ERROR(map.PlaceProducts(data, what));
  KPSA_RETURN_IF_ERROR(map.CheckJoints(data, what));
  map.data_ = std::move(data);
  return map;
}

Status TileMap::PlaceProducts(const TileData& data, const std::string& what) {
  if (data.products.size() != data.ranks.size())
    return Status::Invalid("{}: {} numbers of products for {} tiles", what, data.products.size(),
                           data.ranks.size());
  Place next;
  for (std::size_t t = 0; t < data.products.size(); ++t) {
    const std::size_t count = data.products[t];
    if (count > kMaxProducts || (count > 0 && (data.direct[t] == 1 || data.ranks[t] == 0)))
      return Status::Invalid("{}: tile {} has {} products, expected at most {}, and none without latents",
                             what, t, count, kMaxProducts);
    product_begin_.push_back(next);
    if (count == 0) continue;
    for (std::size_t i = 2 * next.pairs; i < std::min(2 * (next.pairs + count), data.pairs.size()); ++i) {
      const std::uint8_t latent = data.pairs[i];
      if (latent != kUnitLatent && latent >= std::min<std::size_t>(data.ranks[t], kLatents))
        return Status::Invalid("{}: tile {} has a product of latent {} of {}", what, t, latent,
                               data.ranks[t]);
    }
    next.pairs += count, next.whitening += 32, next.lanes += 2 * Padded16(count);
    next.w += count * Padded16(data.ranks[t]), next.doubt += 16 * count;
  }
  if (data.pairs.size() != 2 * next.pairs || data.whitening.size() != next.whitening ||
      data.w.size() != next.w || data.doubt.size() != next.doubt) {
    return Status::Invalid("{}: products of {}, {}, {}, {} values, expected {}, {}, {}, {}", what,
                           data.pairs.size(), data.whitening.size(), data.w.size(), data.doubt.size(),
                           2 * next.pairs, next.whitening, next.w, next.doubt);
  }
  // First latents and second ones apart; what is beyond the last is one times one
  lanes_ = AlignedArray<std::uint8_t>(next.lanes);
  std::fill_n(lanes_.data(), next.lanes, kUnitLatent);
  for (std::size_t t = 0; t < data.products.size(); ++t) {
    for (std::size_t q = 0; q < data.products[t]; ++q) {
      const std::size_t lane = q / kProductLanes * 2 * kProductLanes + q % kProductLanes;
      std::uint8_t* to = lanes_.data() + product_begin_[t].lanes + lane;
      to[0] = data.pairs[2 * (product_begin_[t].pairs + q)];
      to[kProductLanes] = data.pairs[2 * (product_begin_[t].pairs + q) + 1];
    }
  }
  return {};
}

Status TileMap::CheckJoints(const TileData& data, const std::string& what) const {
  const std::size_t joints = data.joint_rows.size() / 12;
  if ((!data.joints.empty() && data.joints.size() != data.ranks.size()) || joints > kMaxTileJoints ||
      data.joint_rows.size() % 12 != 0 || data.joint_mean.size() != data.joint_rows.size() ||
      data.joint_deviation.size() != data.joint_rows.size() || (joints > 0 && data.components != 3)) {
    return Status::Invalid("{}: {}, {}, {}, {} values of joints for {} tiles, expected at most {} joints",
                           what, data.joints.size(), data.joint_rows.size(), data.joint_mean.size(),
                           data.joint_deviation.size(), data.ranks.size(), kMaxTileJoints);
  }
  for (const std::uint32_t joint : data.joints) {
    if (joint > joints) return Status::Invalid("{}: a tile lies in joint {} of {}", what, joint, joints);
  }
  for (std::size_t e = 0; e < data.joint_rows.size(); ++e) {
    if (data.joint_rows[e] >= data.inputs || !std::isfinite(data.joint_mean[e]) ||
        !std::isfinite(data.joint_deviation[e]))
      return Status::Invalid("{}: entry {} of the joints is not finite, or reads cue row {} of {}", what, e,
                             data.joint_rows[e], data.inputs);
  }
  return {};
}

std::size_t TileMap::bytes() const {
  return data_.u.size() + 2 * data_.v.size() +
         4 * (data_.scale.size() + data_.columns.size() + data_.mean.size() + data_.whitening.size()) +
         data_.pairs.size() + 2 * (data_.w.size() + data_.doubt.size());
}
double TileMap::bytes_per_point() const {
  return data_.points == 0 ? 0 : static_cast<double>(bytes()) / static_cast<double>(data_.points);
}
double TileMap::mean_rank() const {
  double sum = 0;
  for (const std::uint32_t rank : data_.ranks) sum += rank;
  return data_.ranks.empty() ? 0 : sum / static_cast<double>(data_.ranks.size());
}
double TileMap::mean_cues() const {
  return data_.ranks.empty()
             ? 0
             : static_cast<double>(data_.columns.size()) / static_cast<double>(data_.ranks.size());
}

void TileMap::Reconstruct(std::span<const float> y, PointsView out, const Matrix4* space) const {
  ReconstructBlock(y, {&out, 1}, {}, {space, space == nullptr ? 0u : 1u});
}

// What the inputs of a tile are computed from, and where they and its doubt (squared, or null) go.
void TileMap::SetTerms(std::size_t tile, float* z, float* doubt, TileTerms* terms) const {
  terms->rank = data_.ranks[tile], terms->k16 = Padded16(terms->rank);
  terms->count = data_.counts[tile], terms->products = products(tile);
  terms->scale = data_.scale.data() + scale_begin_[tile];
  terms->columns = data_.columns.data() + column_begin_[tile];
  terms->direct = data_.direct[tile] == 1;
  terms->v = data_.v.data() + v_begin_[tile];
  terms->z = z, terms->doubt = doubt;
  if (terms->products == 0) return;
  const Place& place = product_begin_[tile];
  terms->lanes = lanes_.data() + place.lanes;
  terms->whitening = data_.whitening.data() + place.whitening;
  terms->w = data_.w.data() + place.w;
  terms->doubt_of = data_.doubt.data() + place.doubt;
}

void TileMap::JointMatricesOf(const float* y, float* entries) const {
  for (std::size_t e = 0; e < data_.joint_rows.size(); ++e) {
    entries[e] = static_cast<float>(data_.joint_mean[e] +
                                    data_.joint_deviation[e] * static_cast<double>(y[data_.joint_rows[e]]));
  }
}

bool TileMap::JointOf(std::size_t tile, const float* y, Matrix4* joint) const {
  if (data_.joints.empty() || data_.joints[tile] == 0) return false;
  float entries[12];
  for (std::size_t i = 0; i < 12; ++i) {
    const std::size_t e = 12 * (data_.joints[tile] - 1) + i;
    entries[i] = static_cast<float>(data_.joint_mean[e] +
                                    data_.joint_deviation[e] * static_cast<double>(y[data_.joint_rows[e]]));
  }
  *joint = MatrixOf(entries);
  return true;
}

Digest TileMap::digest() const {
  if (known_digest_.has_value()) return *known_digest_;
  Hasher hasher;
  hasher.AddLong(std::span<const std::uint8_t>(data_.u.span()));
  hasher.AddLong(std::span<const std::uint16_t>(data_.v.span()));
  hasher.AddLong(std::span<const float>(data_.scale.span()));
  hasher.AddLong(std::span<const std::uint32_t>(data_.columns));
  hasher.AddLong(std::span<const float>(data_.mean.span()));
  hasher.AddLong(std::span<const std::uint8_t>(data_.pairs));
  hasher.AddLong(std::span<const float>(data_.whitening.span()));
  hasher.AddLong(std::span<const std::uint16_t>(data_.w.span()));
  hasher.AddLong(std::span<const std::uint16_t>(data_.doubt.span()));
  for (const auto* list :
       {&data_.ranks, &data_.wide, &data_.counts, &data_.products, &data_.joints, &data_.joint_rows})
    hasher.AddLong(std::span<const std::uint32_t>(*list));
  hasher.AddLong(std::span<const std::uint8_t>(data_.direct));
  for (const auto* list : {&data_.joint_mean, &data_.joint_deviation})
    hasher.AddLong(std::span<const double>(*list));
  return hasher.Finish();
}

TileMap TileMap::WithDoubts(std::span<const double> factors) const {
  KPSA_CHECK_EQ(factors.size(), tiles());
  TileMap result = *this;
  result.known_digest_.reset();
  for (std::size_t t = 0; t < tiles(); ++t) {
    if (products(t) == 0) continue;
    float* scales = result.data_.whitening.data() + product_begin_[t].whitening + 16;
    for (std::size_t i = 0; i < 16; ++i) scales[i] *= static_cast<float>(factors[t]);
  }
  return result;
}

Doubt TileMap::ComputeInputs(std::span<const float> y, std::span<float> inputs,
                             std::span<float> doubts) const {
  KPSA_CHECK(y.size() >= data_.inputs && inputs.size() >= input_size());
  KPSA_CHECK(doubts.empty() || doubts.size() >= tiles());
  Doubt doubt;
  TileTerms terms[kTilesAtOnce];
  float squared[kTilesAtOnce];
  for (std::size_t first = 0; first < tiles(); first += kTilesAtOnce) {
    const std::size_t count = std::min(kTilesAtOnce, tiles() - first);
    for (std::size_t i = 0; i < count; ++i)
      SetTerms(first + i, inputs.data() + scale_begin_[first + i], squared + i, terms + i);
    ComputeTileInputs({terms, count}, y.data());
    for (std::size_t i = 0; i < count; ++i) {
      if (squared[i] > doubt.largest) doubt = {squared[i], static_cast<Index>(first + i)};
      if (!doubts.empty()) doubts[first + i] = std::sqrt(squared[i]);
    }
  }
  JointMatricesOf(y.data(), inputs.data() + data_.scale.size());
  doubt.largest = std::sqrt(doubt.largest);
  return doubt;
}

void TileMap::ReconstructBlock(std::span<const float> y, std::span<const PointsView> outs,
                               std::span<const Index> tiles, std::span<const Matrix4> spaces,
                               std::span<const Index> places) const {
  KPSA_CHECK_LE(outs.size() * data_.inputs, y.size());
  Run(
      [&](std::span<const std::size_t> some, std::size_t frame, InputSpace* space, const float** t) {
        TileTerms terms[kTilesAhead];
        for (std::size_t i = 0; i < some.size(); ++i) {
          t[i] = space[i].t;
          SetTerms(some[i], space[i].t, nullptr, terms + i);
        }
        ComputeTileInputs({terms, some.size()}, y.data() + frame * data_.inputs);
      },
      [&](std::size_t frame, float* entries) { JointMatricesOf(y.data() + frame * data_.inputs, entries); },
      outs, tiles, spaces, places);
}

void TileMap::ReconstructFrom(std::span<const float* const> inputs, std::span<const PointsView> outs,
                              std::span<const Index> tiles, std::span<const Matrix4> spaces,
                              std::span<const Index> places) const {
  KPSA_CHECK_EQ(inputs.size(), outs.size());
  Run(
      [&](std::span<const std::size_t> some, std::size_t frame, InputSpace*, const float** t) {
        for (std::size_t i = 0; i < some.size(); ++i) t[i] = inputs[frame] + scale_begin_[some[i]];
      },
      [&](std::size_t frame, float* entries) {
        std::copy_n(inputs[frame] + data_.scale.size(), data_.joint_rows.size(), entries);
      },
      outs, tiles, spaces, places);
}

template <typename InputsOf, typename JointsOf>
void TileMap::Run(const InputsOf& inputs_of, const JointsOf& joints_of, std::span<const PointsView> outs,
                  std::span<const Index> tiles, std::span<const Matrix4> spaces,
                  std::span<const Index> places) const {
  if (outs.empty()) return;
  KPSA_CHECK(places.empty() || places.size() == tiles.size());
  for (const Index place : places) KPSA_CHECK(place % 16 == 0 && place < outs[0].count);
  for (const PointsView& out : outs) KPSA_CHECK(!places.empty() || out.count == data_.points);
  KPSA_CHECK(spaces.empty() || (spaces.size() == outs.size() && data_.components == 3));
  for (std::size_t i = 0; i < tiles.size(); ++i)
    KPSA_CHECK(tiles[i] < this->tiles() && (i == 0 || tiles[i - 1] < tiles[i]));
  const std::size_t rows = kPanelPoints * static_cast<std::size_t>(data_.components);
  const auto quantize = HWY_DYNAMIC_DISPATCH(QuantizeInputs);
  const auto tile_panels =
      data_.components == 3 ? HWY_DYNAMIC_DISPATCH(TilePanels3) : HWY_DYNAMIC_DISPATCH(TilePanels1);
  const std::size_t count = tiles.empty() ? this->tiles() : tiles.size();
  // The inputs of some tiles, then their points: short chains of dependent instructions, which overlap
  TileInput input[kTilesAhead][kBlockFrames];
  TileFrame frames[kTilesAhead][kBlockFrames];
  InputSpace space_of_inputs[kTilesAhead];
  const float* t[kTilesAhead];
  std::size_t some[kTilesAhead];
  const std::size_t joint_count = data_.joint_rows.size() / 12;
  FloatMatrix joint_space[kBlockFrames][kMaxTileJoints];
  for (std::size_t first = 0; first < outs.size(); first += kBlockFrames) {
    const std::size_t frame_count = std::min(kBlockFrames, outs.size() - first);
    FloatMatrix space[kBlockFrames];
    for (std::size_t f = 0; f < frame_count && !spaces.empty(); ++f) space[f] = ToFloats(spaces[first + f]);
    for (std::size_t f = 0; f < frame_count && joint_count > 0; ++f) {
      float entries[12 * kMaxTileJoints];
      joints_of(first + f, entries);
      for (std::size_t j = 0; j < joint_count; ++j) {
        if (spaces.empty()) {
          std::copy_n(entries + 12 * j, 12, joint_space[f][j].data());
        } else {
          joint_space[f][j] = ToFloats(spaces[first + f] * MatrixOf(entries + 12 * j));
        }
      }
    }
    for (std::size_t next = 0; next < count; next += kTilesAhead) {
      const std::size_t ahead = std::min(kTilesAhead, count - next);
      for (std::size_t i = 0; i < ahead; ++i) some[i] = tiles.empty() ? next + i : tiles[next + i];
      for (std::size_t f = 0; f < frame_count; ++f) {
        inputs_of({some, ahead}, first + f, space_of_inputs, t);
        for (std::size_t i = 0; i < ahead; ++i) {
          frames[i][f].q = input[i][f].q;
          frames[i][f].out = outs[first + f];
          const std::size_t joint = data_.joints.empty() ? 0 : data_.joints[some[i]];
          frames[i][f].space = joint > 0 ? &joint_space[f][joint - 1] : spaces.empty() ? nullptr : &space[f];
          quantize(data_.wide[some[i]], data_.ranks[some[i]], t[i], input[i][f].q, &frames[i][f]);
        }
      }
      for (std::size_t i = 0; i < ahead; ++i) {
        const std::size_t tile = some[i], begin = places.empty() ? tile * kTilePoints : places[next + i];
        tile_panels(data_.u.data() + u_begin_[tile], TilePanelCount(data_.points, tile),
                    Groups(data_.ranks[tile], data_.wide[tile]),
                    data_.mean.data() + tile * (kTilePoints / kPanelPoints) * rows, begin, frames[i],
                    frame_count);
      }
    }
  }
}

}  // namespace kpsa::engine
#endif  // HWY_ONCE
