#include "nodes/kernels/lattice.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

#include "base/check.h"
#include "nodes/kernels/affine_delta.h"
#include "nodes/kernels/weights.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/kernels/lattice.cpp"
#include "hwy/foreach_target.h"

#include "nodes/kernels/affine-inl.h"
#include "nodes/kernels/xyzw-inl.h"

HWY_BEFORE_NAMESPACE();
namespace kpsa::engine {
namespace HWY_NAMESPACE {

// out += weight * sum_u wu sum_t wt sum_s ws offset(s, t, u) for tiles of 16 points.
// axis: per tile the rows ws, wt, wu of 16; offsets: x y z 0 of each control. rows: for each u, a bit for
// every t whose controls move. The others would add 0 to sums that begin with +0, which changes no bit.
void BlendTiles(const Index* tiles, const float* axis, std::size_t tile_count, std::size_t ds, std::size_t dt,
                std::size_t du, const float* offsets, const std::uint32_t* rows, const float* weights,
                PointsView out) {
  const DLanes d;
  for (std::size_t tile = 0; tile < tile_count; ++tile, axis += 16 * (ds + dt + du)) {
    for (std::size_t lane = 0; lane < 16; lane += hn::Lanes(d)) {
      const float *ws = axis + lane, *wt = ws + 16 * ds, *wu = wt + 16 * dt;
      VLanes x = hn::Zero(d), y = x, z = x;
      for (std::size_t u = 0; u < du; ++u) {
        if (rows[u] == 0) continue;
        VLanes ux = hn::Zero(d), uy = ux, uz = ux;
        for (std::uint32_t left = rows[u]; left != 0; left &= left - 1) {
          const auto t = static_cast<std::size_t>(std::countr_zero(left));
          const float* control = offsets + 4 * ds * (t + dt * u);
          VLanes w = hn::Load(d, ws);
          VLanes tx = hn::Mul(w, hn::Set(d, control[0]));
          VLanes ty = hn::Mul(w, hn::Set(d, control[1]));
          VLanes tz = hn::Mul(w, hn::Set(d, control[2]));
          control += 4;
          for (std::size_t s = 1; s < ds; ++s, control += 4) {
            w = hn::Load(d, ws + 16 * s);
            tx = Fma(w, hn::Set(d, control[0]), tx);
            ty = Fma(w, hn::Set(d, control[1]), ty);
            tz = Fma(w, hn::Set(d, control[2]), tz);
          }
          w = hn::Load(d, wt + 16 * t);
          ux = Fma(w, tx, ux);
          uy = Fma(w, ty, uy);
          uz = Fma(w, tz, uz);
        }
        const VLanes w = hn::Load(d, wu + 16 * u);
        x = Fma(w, ux, x);
        y = Fma(w, uy, y);
        z = Fma(w, uz, z);
      }
      const std::size_t p = tiles[tile] + lane;
      const VLanes w = hn::Load(d, weights + p);
      const auto moves = hn::Ne(w, hn::Zero(d));
      const VLanes px = hn::Load(d, out.x + p), py = hn::Load(d, out.y + p), pz = hn::Load(d, out.z + p);
      hn::Store(hn::IfThenElse(moves, Fma(w, x, px), px), d, out.x + p);
      hn::Store(hn::IfThenElse(moves, Fma(w, y, py), py), d, out.y + p);
      hn::Store(hn::IfThenElse(moves, Fma(w, z, pz), pz), d, out.z + p);
    }
  }
}

std::size_t MovedControls(const ConstPointsView& now, const ConstPointsView& rest,
                          Index* HWY_RESTRICT moved) {
  const DLanes d;
  std::size_t count = 0;
  for (std::size_t begin = 0; begin < now.count; begin += hn::Lanes(d)) {
    const auto equal = [&](const float* a, const float* b) HWY_ATTR {  // no NaN is
      return hn::Eq(hn::Load(d, a + begin), hn::Load(d, b + begin));
    };
    const auto rests = hn::And(equal(now.x, rest.x), hn::And(equal(now.y, rest.y), equal(now.z, rest.z)));
    std::uint8_t bytes[8] = {};
    hn::StoreMaskBits(d, hn::Not(rests), bytes);
    std::uint64_t bits;
    std::memcpy(&bits, bytes, sizeof(bits));
    bits &= (std::uint64_t{1} << HWY_MIN(hn::Lanes(d), now.count - begin)) - 1;
    for (; bits != 0; bits &= bits - 1)
      moved[count++] = static_cast<Index>(begin + static_cast<std::size_t>(std::countr_zero(bits)));
  }
  return count;
}

// The moves of these controls, which a matrix and the envelope take to the points' space, at their places in `moves`.
void ControlMoves(const Matrix4& matrix, double envelope, const Double3* HWY_RESTRICT offsets,
                  const Index* moved, std::size_t count, float* HWY_RESTRICT moves) {
  FourColumns m = LoadColumns(matrix);
  for (Four& column : m.c) column = Four{column[0], column[1], column[2], 0};
  for (std::size_t i = 0; i < count; ++i) {
    const Double3& offset = offsets[moved[i]];
    const Four move = m.c[0] * offset.x + m.c[1] * offset.y + m.c[2] * offset.z;
    StoreFour(move * envelope, moves + 4 * std::size_t{moved[i]});
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kpsa::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace kpsa::engine {

HWY_EXPORT(BlendTiles);
HWY_EXPORT(MovedControls);
HWY_EXPORT(ControlMoves);

std::size_t FindMovedControls(const ConstPointsView& now, const ConstPointsView& rest,
                              Index* moved) noexcept {
  return HWY_DYNAMIC_DISPATCH(MovedControls)(now, rest, moved);
}

namespace {
constexpr double kRim =
    1e-6;  // a point this far outside counts as inside: lattices are fitted to bounding boxes
// Controls are fewer than 2^15, divisions 32 at most: a product with their share, rounded up, is exact
constexpr std::size_t kShare = std::size_t{1} << 20;
constexpr std::size_t kDenseControls = 13;  // measured: a stored control costs as much as 13 of the dense sum
}  // namespace

Status LatticeSettings::Validate() const {
  for (int axis = 0; axis < 3; ++axis) {
    const std::size_t a = static_cast<std::size_t>(axis);
    if (divisions[a] < 2 || divisions[a] > 32) {
      return Status::Invalid("a lattice of {} x {} x {} divisions, expected 2 to 32 along each axis",
                             divisions[0], divisions[1], divisions[2]);
    }
    if (local && (influence[a] < 2 || influence[a] > 32)) {
      return Status::Invalid("a lattice's local influence of {} {} {}, expected 2 to 32 each", influence[0],
                             influence[1], influence[2]);
    }
  }
  if (outside == LatticeOutside::kFalloff && !(falloff_distance > 0 && std::isfinite(falloff_distance))) {
    return Status::Invalid("a lattice's falloff distance of {}, expected more than 0", falloff_distance);
  }
  return {};
}

std::vector<double> LatticeBasis(int divisions, int order, double x) {
  x = std::clamp(x, 0.0, 1.0);
  const std::size_t n = static_cast<std::size_t>(divisions);
  std::vector<double> w(n, 0.0);
  if (order == 0) {  // Bernstein, degree by degree
    w[0] = 1;
    for (std::size_t degree = 1; degree < n; ++degree) {
      for (std::size_t i = degree; i > 0; --i) w[i] = (1 - x) * w[i] + x * w[i - 1];
      w[0] *= 1 - x;
    }
    return w;
  }
  // Cox and de Boor on clamped uniform knots: knot i lies at clamp(i - degree, 0, spans) / spans
  const int degree = std::min(order, divisions) - 1, spans = divisions - degree;
  const auto knot = [&](int i) { return static_cast<double>(std::clamp(i - degree, 0, spans)); };
  const double u = x * spans;
  const int span = std::min(static_cast<int>(u), spans - 1) + degree;
  std::vector<double> b(static_cast<std::size_t>(degree) + 1, 0.0);
  b[0] = 1;
  for (int k = 1; k <= degree; ++k) {
    double carried = 0;
    for (int i = 0; i < k; ++i) {
      const double right = knot(span + i + 1), left = knot(span + i + 1 - k);
      const double part = b[static_cast<std::size_t>(i)] / (right - left);
      b[static_cast<std::size_t>(i)] = carried + (right - u) * part;
      carried = (u - left) * part;
    }
    b[static_cast<std::size_t>(k)] = carried;
  }
  for (int i = 0; i <= degree; ++i)
    w[static_cast<std::size_t>(span - degree + i)] = b[static_cast<std::size_t>(i)];
  return w;
}

LatticeKernel::LatticeKernel(const LatticeSettings& settings, ConstPointsView rest,
                             const Matrix4& lattice_from_rest, std::span<const Index> out_points,
                             std::span<const float> point_weights)
    : count_(out_points.size()), weights_(PaddedWeights(point_weights, out_points.size())) {
  KPSA_CHECK(IsSortedSet(out_points, rest.count));
  std::array<int, 3> order = {0, 0, 0};
  std::size_t width = 1;
  controls_ = 1;
  for (std::size_t a = 0; a < 3; ++a) {
    divisions_[a] = static_cast<std::size_t>(settings.divisions[a]);
    controls_ *= divisions_[a];
    if (settings.local) order[a] = std::min(settings.influence[a], settings.divisions[a]);
    width *= static_cast<std::size_t>(settings.local ? order[a] : settings.divisions[a]);
  }
  sparse_ = settings.local && controls_ > kDenseControls * width;
  over_s_ = static_cast<std::uint32_t>(kShare / divisions_[0] + 1);
  over_t_ = static_cast<std::uint32_t>(kShare / divisions_[1] + 1);

  std::vector<Index> row_controls;
  std::vector<float> row_weights, rows;
  const std::size_t row_count = divisions_[0] + divisions_[1] + divisions_[2];
  for (std::size_t i = 0; i < count_; ++i) {
    const Index p = out_points[i];
    const Double3 q =
        TransformPoint(lattice_from_rest, {rest.x[p], rest.y[p], rest.z[p]}) + Double3{0.5, 0.5, 0.5};
    Double3 nearest = q;
    for (int a = 0; a < 3; ++a) nearest[a] = std::clamp(q[a], 0.0, 1.0);
    const double distance = Length(q - nearest);
    float& weight = weights_.data()[i];
    if (!(distance <= kRim)) {
      if (settings.outside == LatticeOutside::kInside) weight = 0;
      if (settings.outside == LatticeOutside::kFalloff) {
        weight *= static_cast<float>(std::max(0.0, 1 - distance / settings.falloff_distance));
      }
    }
    std::array<std::vector<double>, 3> basis;
    if (sparse_ || weight != 0) {
      for (int a = 0; a < 3; ++a) {
        basis[static_cast<std::size_t>(a)] = LatticeBasis(settings.divisions[static_cast<std::size_t>(a)],
                                                          order[static_cast<std::size_t>(a)], nearest[a]);
      }
    }
    if (sparse_) {
      // The block of `order` controls along each axis that holds all that are not 0
      std::array<std::size_t, 3> first, size;
      for (std::size_t a = 0; a < 3; ++a) {
        size[a] = static_cast<std::size_t>(order[a]);
        first[a] = 0;
        while (first[a] + size[a] < divisions_[a] && basis[a][first[a]] == 0) ++first[a];
      }
      for (std::size_t u = first[2]; u < first[2] + size[2]; ++u) {
        for (std::size_t t = first[1]; t < first[1] + size[1]; ++t) {
          for (std::size_t s = first[0]; s < first[0] + size[0]; ++s) {
            row_controls.push_back(static_cast<Index>(s + divisions_[0] * (t + divisions_[1] * u)));
            row_weights.push_back(static_cast<float>(weight * (basis[0][s] * basis[1][t] * basis[2][u])));
          }
        }
      }
    } else if (weight != 0) {
      const Index tile = static_cast<Index>(i / 16 * 16);
      if (tiles_.empty() || tiles_.back() != tile) {
        tiles_.push_back(tile);
        rows.resize(rows.size() + 16 * row_count, 0.0f);
      }
      float* to = rows.data() + 16 * row_count * (tiles_.size() - 1) + (i - tile);
      for (const std::vector<double>& axis : basis) {
        for (double w : axis) *to = static_cast<float>(w), to += 16;
      }
    }
  }
  if (sparse_) blend_ = ControlBlend(width, row_controls, row_weights);
  axis_weights_ = AlignedFloats(rows.size());
  std::copy(rows.begin(), rows.end(), axis_weights_.data());
}

void LatticeKernel::Run(const Inputs& inputs, ConstPointsView in, PointsView out, std::span<float> scratch,
                        const Parallel* parallel) const noexcept {
  KPSA_CHECK_EQ(inputs.offsets.size(), controls_);
  KPSA_CHECK_EQ(in.count, count_);
  KPSA_CHECK_EQ(out.count, count_);
  KPSA_CHECK_LE(ScratchFloats(), scratch.size());
  const float envelope = static_cast<float>(inputs.envelope);
  if (envelope == 0 || count_ == 0) return CopyPoints(in, out);

  // The move of the lattice as a whole
  Matrix4 lattice_from_points;
  const bool moved = inputs.matrix != inputs.base_matrix && Invert(inputs.base_matrix, &lattice_from_points);
  if (moved) {
    const AffineDelta delta =
        MakeAffineDelta(inputs.matrix * lattice_from_points,
                        {inputs.base_matrix(0, 3), inputs.base_matrix(1, 3), inputs.base_matrix(2, 3)});
    ForRanges(parallel, count_, 4096, [&](std::size_t begin, std::size_t end) {
      ApplyAffineDelta(delta, weights_.data(), envelope, in, out, begin, end);
    });
  } else {
    CopyPoints(in, out);
  }

  // The moves of the controls, in the points' space. Most rest; not even they have numbers where the matrix has none
  float* const moves = scratch.data();
  const Index first = 0;
  const Double3 none;
  HWY_DYNAMIC_DISPATCH(ControlMoves)(inputs.matrix, inputs.envelope, &none, &first, 1, moves);
  std::array<float, 4> resting;
  std::memcpy(resting.data(), moves, sizeof(resting));
  const bool rest_moves = (moves[0] != 0) | (moves[1] != 0) | (moves[2] != 0);
  if (inputs.moved.empty() && !rest_moves) return;
  std::array<std::uint32_t, 32> rows;
  for (std::size_t u = 0; u < divisions_[2]; ++u) rows[u] = 0;
  const auto fill = [&](std::size_t begin, std::size_t end) {
    for (std::size_t c = begin; c < end; ++c) std::memcpy(moves + 4 * c, resting.data(), sizeof(resting));
  };
  const std::size_t ds = divisions_[0], dt = divisions_[1];
  if (sparse_ || rest_moves) {  // all controls are read
    if (rest_moves) {
      fill(0, controls_);
    } else {
      std::memset(moves, 0, 4 * controls_ * sizeof(float));
    }
    if (rest_moves) rows.fill(~std::uint32_t{0} >> (32 - dt));
  } else {
    std::size_t filled = 0;  // up to the end of a row
    for (const Index c : inputs.moved) {
      const std::uint32_t row = (c * over_s_) / kShare, u = (row * over_t_) / kShare;
      rows[u] |= std::uint32_t{1} << (row - u * dt);
      if (c >= filled) fill(row * ds, filled = (row + 1) * ds);
    }
  }
  HWY_DYNAMIC_DISPATCH(ControlMoves)
  (inputs.matrix, inputs.envelope, inputs.offsets.data(), inputs.moved.data(), inputs.moved.size(), moves);
  if (sparse_) {
    blend_.Run(moves, out, parallel);
    return;
  }
  const std::size_t row_count = divisions_[0] + divisions_[1] + divisions_[2];
  ForRanges(parallel, tiles_.size(), 32, [&](std::size_t begin, std::size_t end) {
    HWY_DYNAMIC_DISPATCH(BlendTiles)
    (tiles_.data() + begin, axis_weights_.data() + begin * 16 * row_count, end - begin, divisions_[0],
     divisions_[1], divisions_[2], moves, rows.data(), weights_.data(), out);
  });
}

}  // namespace kpsa::engine
#endif  // HWY_ONCE
