// Factors the map of each tile; see kpsa/tiles.h.
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstring>

#include "base/check.h"
#include "base/parallel.h"
#include "kpsa/eigen_solvers.h"
#include "kpsa/tiles.h"

namespace kpsa {
namespace {

constexpr std::size_t kVPanelRows = 96;

// One tile before it is laid out: product ~ u * v with u and v as halfs times 2^-exponent.
struct Factors {
  bool direct = false;
  Eigen::MatrixXd u;           // [c * points x k] values that are exact in half precision
  Eigen::MatrixXd v;           // [k x r] likewise; empty for a direct tile
  std::vector<float> scale;    // [k] power of two
  double squared_error = 0;    // expected, summed over the points of the tile
};

double RoundToHalf(double value) { return static_cast<double>(FloatFromHalf(HalfFromFloat(static_cast<float>(value)))); }

// Scales every column so that its largest entry lies in [2^13, 2^14), and rounds it to half precision.
void Quantize(Factors* f) {
  f->scale.clear();
  for (Eigen::Index k = 0; k < f->u.cols(); ++k) {
    const double largest = f->u.rows() == 0 ? 0 : f->u.col(k).cwiseAbs().maxCoeff();
    int exponent = 0;
    if (largest > 0) std::frexp(largest, &exponent);
    exponent = std::clamp(14 - exponent, -100, 100);
    f->scale.push_back(static_cast<float>(std::ldexp(1.0, -exponent)));
    f->u.col(k) = (f->u.col(k) * std::ldexp(1.0, exponent)).unaryExpr(&RoundToHalf);
  }
}

Eigen::MatrixXd Product(const Factors& f) {
  const Eigen::VectorXd scale = Eigen::Map<const Eigen::VectorXf>(f.scale.data(), static_cast<Eigen::Index>(f.scale.size())).cast<double>();
  const Eigen::MatrixXd u = f.u * scale.asDiagonal();
  return f.direct ? u : Eigen::MatrixXd(u * f.v);
}

Factors FactorTile(const Eigen::MatrixXd& b, std::size_t padded_rows, int components, double rms_budget) {
  const double points = static_cast<double>(b.rows() / components);
  const double budget = rms_budget * rms_budget * points;
  const Eigen::Index r = b.cols();
  const SymmetricEigen eigen = AllEigen(b.transpose() * b);  // values are squared singular values
  double rest = eigen.values.cwiseMax(0.0).sum();
  Eigen::Index rank = 0;
  while (rank < r && rest > 0.8 * budget) rest -= std::max(0.0, eigen.values[rank++]);

  // Rounding to halfs takes a part of the budget, too: more columns where that leaves too little
  Factors best;
  for (;; ++rank) {
    const auto columns = static_cast<std::size_t>(rank), inputs = static_cast<std::size_t>(r);
    Factors f;
    f.direct = columns * (padded_rows + inputs) >= inputs * padded_rows;
    if (f.direct) {
      f.u = b;
    } else {
      f.v = eigen.vectors.leftCols(rank).transpose().unaryExpr(&RoundToHalf);
      // The best U for V as rounded
      if (rank > 0) f.u = (f.v * f.v.transpose()).llt().solve(f.v * b.transpose()).transpose();
      if (rank == 0) f.u.resize(b.rows(), 0);
    }
    Quantize(&f);
    f.squared_error = rank == 0 ? b.squaredNorm() : (b - Product(f)).squaredNorm();
    const bool better = best.scale.empty() || f.squared_error < 0.9 * best.squared_error;
    if (better || f.squared_error <= budget) best = std::move(f);
    if (best.squared_error <= budget || best.direct || !better) return best;
  }
}

}  // namespace

TileMap BuildTiles(const Eigen::MatrixXd& gain, const Eigen::VectorXd& mean, int components, const TileOptions& options, TileReport* report) {
  KPSA_CHECK(components == 1 || components == 3);
  KPSA_CHECK_EQ(gain.rows(), mean.size());
  TileData data;
  const auto c = static_cast<std::size_t>(components);
  data.points = static_cast<std::size_t>(gain.rows()) / c;
  data.components = components;
  data.inputs = static_cast<std::size_t>(gain.cols());
  const std::size_t tiles = (data.points + kTilePoints - 1) / kTilePoints, rows = kPanelPoints * c;
  const auto panels = [&](std::size_t tile) {
    return (std::min(kTilePoints, data.points - tile * kTilePoints) + kPanelPoints - 1) / kPanelPoints;
  };
  std::vector<Factors> factors(tiles);
  ParallelFor(tiles, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      const std::size_t first = t * kTilePoints * c, height = std::min(kTilePoints * c, data.points * c - first);
      factors[t] = FactorTile(gain.middleRows(static_cast<Eigen::Index>(first), static_cast<Eigen::Index>(height)), panels(t) * rows,
                              components, options.rms_budget);
    }
  });

  // Sizes, then the layout of kpsa/tiles.h
  std::size_t v_rows = 0, direct_rows = 0, u_size = 0;
  double squared_error = 0;
  TileReport found;
  for (std::size_t t = 0; t < tiles; ++t) {
    const std::size_t rank = factors[t].scale.size();
    const std::size_t points = std::min(kTilePoints, data.points - t * kTilePoints);
    data.ranks.push_back(static_cast<std::uint32_t>(rank));
    data.direct.push_back(factors[t].direct ? 1 : 0);
    (factors[t].direct ? direct_rows : v_rows) += rank;
    u_size += panels(t) * rank * rows;
    squared_error += factors[t].squared_error;
    found.worst_tile_rms = std::max(found.worst_tile_rms, std::sqrt(factors[t].squared_error / static_cast<double>(points)));
    found.direct_tiles += factors[t].direct ? 1 : 0;
  }
  found.rms = data.points == 0 ? 0 : std::sqrt(squared_error / static_cast<double>(data.points));
  v_rows = (v_rows + kVPanelRows - 1) / kVPanelRows * kVPanelRows;
  data.v = AlignedArray<std::uint16_t>(v_rows * data.inputs);
  data.u = AlignedArray<std::uint16_t>(u_size);
  data.mean = AlignedArray<float>((data.points + kPanelPoints - 1) / kPanelPoints * rows);
  data.scale = AlignedArray<float>(v_rows + direct_rows);
  std::fill_n(data.scale.data(), data.scale.size(), 1.0f);
  for (std::size_t i = 0; i < data.points * c; ++i) {
    const std::size_t point = i / c;
    data.mean.data()[point / kPanelPoints * rows + i % c * kPanelPoints + point % kPanelPoints] = static_cast<float>(mean[static_cast<Eigen::Index>(i)]);
  }
  std::size_t v_row = 0, direct_row = v_rows;
  std::uint16_t* u = data.u.data();
  for (std::size_t t = 0; t < tiles; ++t) {
    const Factors& f = factors[t];
    const std::size_t rank = f.scale.size();
    for (std::size_t k = 0; k < rank; ++k) {
      const auto column = static_cast<Eigen::Index>(k);
      const std::size_t z = f.direct ? direct_row++ : v_row++;
      data.scale.data()[z] = f.scale[k];
      for (std::size_t j = 0; j < data.inputs && !f.direct; ++j) {
        data.v.data()[(z / kVPanelRows * data.inputs + j) * kVPanelRows + z % kVPanelRows] =
            HalfFromFloat(static_cast<float>(f.v(column, static_cast<Eigen::Index>(j))));
      }
      for (Eigen::Index i = 0; i < f.u.rows(); ++i) {
        const std::size_t point = static_cast<std::size_t>(i) / c, panel = point / kPanelPoints;
        u[(panel * rank + k) * rows + static_cast<std::size_t>(i) % c * kPanelPoints + point % kPanelPoints] =
            HalfFromFloat(static_cast<float>(f.u(i, column)));
      }
    }
    u += panels(t) * rank * rows;
  }
  if (report != nullptr) *report = found;
  Result<TileMap> map = TileMap::Make(std::move(data), "tiles");
  KPSA_CHECK(map.ok());
  return std::move(*map);
}

std::uint16_t HalfFromFloat(float value) {
  std::uint32_t bits;
  std::memcpy(&bits, &value, 4);
  const auto sign = static_cast<std::uint16_t>(bits >> 16 & 0x8000u);
  bits &= 0x7fffffffu;
  if (bits >= 0x7f800000u) return static_cast<std::uint16_t>(sign | (bits > 0x7f800000u ? 0x7e00u : 0x7c00u));
  if (bits < 0x38800000u) {  // below 2^-14: a multiple of 2^-24
    float magnitude;
    std::memcpy(&magnitude, &bits, 4);
    return static_cast<std::uint16_t>(sign | static_cast<std::uint16_t>(std::nearbyint(magnitude * 16777216.0f)));
  }
  bits += 0xfffu + (bits >> 13 & 1u);  // to nearest, ties to even; the carry may raise the exponent
  const std::uint32_t half = (bits - 0x38000000u) >> 13;
  return static_cast<std::uint16_t>(sign | (half >= 0x7c00u ? 0x7c00u : half));
}

float FloatFromHalf(std::uint16_t half) {
  const std::uint32_t sign = (half & 0x8000u) << 16, exponent = half >> 10 & 0x1fu, fraction = half & 0x3ffu;
  std::uint32_t bits;
  if (exponent == 0) {
    const float magnitude = static_cast<float>(fraction) / 16777216.0f;
    std::memcpy(&bits, &magnitude, 4);
  } else {
    bits = ((exponent == 31 ? 255u : exponent + 112u) << 23) | fraction << 13;
  }
  bits |= sign;
  float value;
  std::memcpy(&value, &bits, 4);
  return value;
}

}  // namespace kpsa
