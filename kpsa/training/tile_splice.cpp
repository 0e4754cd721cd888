#include "kpsa/training/tile_splice.h"

#include <algorithm>

#include "base/check.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kJointRows = 12;

// What the arrays of a map hold of one tile.
struct TileSlice {
  std::uint32_t rank = 0, wide = 0, count = 0, products = 0, joint = 0;
  std::uint8_t direct = 0;
  std::span<const std::uint32_t> columns;
  std::span<const float> scale, mean, whitening;
  std::span<const std::uint16_t> v, w, doubt;
  std::span<const std::uint8_t> u, pairs;
};

std::vector<TileSlice> SlicesOf(const TileData& data) {
  std::vector<TileSlice> slices;
  const std::size_t rows = kPanelPoints * static_cast<std::size_t>(data.components);
  std::size_t columns = 0, scale = 0, v = 0, u = 0, pairs = 0, whitening = 0, w = 0, doubt = 0;
  const auto next = [](const auto& all, std::size_t count, std::size_t* at) {
    const std::span part(all.data() + *at, count);
    *at += count;
    return part;
  };
  for (std::size_t t = 0; t < data.ranks.size(); ++t) {
    TileSlice s;
    s.rank = data.ranks[t], s.wide = data.wide[t], s.count = data.counts[t], s.direct = data.direct[t];
    s.products = data.products.empty() ? 0 : data.products[t];
    s.joint = data.joints.empty() ? 0 : data.joints[t];
    const std::size_t k16 = (s.rank + 15) / 16 * 16, first = t * kTilePoints;
    const std::size_t panels = (std::min(kTilePoints, data.points - first) + kPanelPoints - 1) / kPanelPoints;
    s.columns = next(data.columns, s.count, &columns);
    s.scale = next(data.scale, k16, &scale);
    s.v = next(data.v, s.direct != 0 ? 0 : s.count * k16, &v);
    s.u = next(data.u, panels * ((s.rank + s.wide + 3) / 4 * 4) * rows, &u);
    s.mean = data.mean.span().subspan(first / kPanelPoints * rows, panels * rows);
    s.pairs = next(data.pairs, 2 * s.products, &pairs);
    s.whitening = next(data.whitening, s.products > 0 ? 32 : 0, &whitening);
    s.w = next(data.w, s.products * k16, &w);
    s.doubt = next(data.doubt, 16 * s.products, &doubt);
    slices.push_back(s);
  }
  return slices;
}

template <typename T>
AlignedArray<T> Joined(const std::vector<TileSlice>& slices, std::span<const T> TileSlice::*part) {
  std::size_t size = 0;
  for (const TileSlice& slice : slices) size += (slice.*part).size();
  AlignedArray<T> all(size);
  T* to = all.data();
  for (const TileSlice& slice : slices) to = std::ranges::copy(slice.*part, to).out;
  return all;
}

std::span<const std::uint32_t> RowsOf(const TileData& data, std::uint32_t joint) {
  return std::span(data.joint_rows).subspan((joint - 1) * kJointRows, kJointRows);
}

// The number of a joint of another map, which is added where it is new.
std::uint32_t NumberOf(const TileData& from, std::uint32_t joint, TileData* to) {
  if (joint == 0) return 0;
  const auto joints = static_cast<std::uint32_t>(to->joint_rows.size() / kJointRows);
  for (std::uint32_t known = 1; known <= joints; ++known) {
    if (std::ranges::equal(RowsOf(*to, known), RowsOf(from, joint))) return known;
  }
  for (std::size_t e = (joint - 1) * kJointRows; e < joint * kJointRows; ++e) {
    to->joint_rows.push_back(from.joint_rows[e]);
    to->joint_mean.push_back(from.joint_mean[e]);
    to->joint_deviation.push_back(from.joint_deviation[e]);
  }
  return joints + 1;
}

}  // namespace

TileMap SpliceTiles(const TileMap& map, const TileMap& others, std::span<const char> taken) {
  const TileData &a = map.data(), &b = others.data();
  KPSA_CHECK(a.points == b.points && a.components == b.components && a.inputs == b.inputs);
  TileData data;
  data.points = a.points, data.components = a.components, data.inputs = a.inputs;
  data.joint_rows = a.joint_rows, data.joint_mean = a.joint_mean, data.joint_deviation = a.joint_deviation;
  std::vector<TileSlice> slices = SlicesOf(a);
  const std::vector<TileSlice> of_others = SlicesOf(b);
  for (std::size_t t = 0; t < slices.size(); ++t) {
    if (taken[t] != 0) {
      slices[t] = of_others[t];
      slices[t].joint = NumberOf(b, slices[t].joint, &data);
    }
    const TileSlice& s = slices[t];
    data.ranks.push_back(s.rank), data.wide.push_back(s.wide), data.counts.push_back(s.count);
    data.direct.push_back(s.direct), data.products.push_back(s.products), data.joints.push_back(s.joint);
    data.columns.insert(data.columns.end(), s.columns.begin(), s.columns.end());
    data.pairs.insert(data.pairs.end(), s.pairs.begin(), s.pairs.end());
  }
  if (data.pairs.empty()) data.products.clear();
  if (data.joint_rows.empty()) data.joints.clear();
  data.scale = Joined(slices, &TileSlice::scale), data.mean = Joined(slices, &TileSlice::mean);
  data.whitening = Joined(slices, &TileSlice::whitening);
  data.v = Joined(slices, &TileSlice::v), data.w = Joined(slices, &TileSlice::w);
  data.doubt = Joined(slices, &TileSlice::doubt), data.u = Joined(slices, &TileSlice::u);
  Result<TileMap> spliced = TileMap::Make(std::move(data), "tiles");
  KPSA_CHECK(spliced.ok());
  return std::move(*spliced);
}

std::vector<char> SameTiles(const TileMap& a, const TileMap& b) {
  const std::vector<TileSlice> of_a = SlicesOf(a.data()), of_b = SlicesOf(b.data());
  std::vector<char> same;
  for (std::size_t t = 0; t < std::min(of_a.size(), of_b.size()); ++t) {
    const TileSlice &x = of_a[t], &y = of_b[t];
    const auto equal = [&](auto part) { return std::ranges::equal(x.*part, y.*part); };
    same.push_back(x.rank == y.rank && x.wide == y.wide && x.count == y.count && x.direct == y.direct &&
                   (x.joint == 0) == (y.joint == 0) && equal(&TileSlice::scale) && equal(&TileSlice::mean) &&
                   equal(&TileSlice::whitening) && equal(&TileSlice::v) && equal(&TileSlice::w) &&
                   equal(&TileSlice::doubt) && equal(&TileSlice::u) && equal(&TileSlice::pairs));
  }
  return same;
}

}  // namespace kpsa::engine
