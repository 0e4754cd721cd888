// Reconstruction at run time: x = mean + U (V w), tile by tile, in half precision with float32 accumulation.
// Glossary: w the r whitened measurements (unit covariance: Estimator::whitening * y), a tile 128 points in the order
// given, k its rank, P panels of 32 points, c components (3 or 1).
//
// The map B W^-1 [cN x r] of each tile is factored by a truncated SVD in output units: the rank is the smallest that
// leaves the tile's expected RMS below a budget (w has unit covariance, so singular values are RMS errors). Where the
// factors are no smaller than the product, the product is stored (a "direct" tile).
//
// Layout: panels of 32c rows; a panel holds its columns one after the other, 32c halfs each (x of 32 points, y, z), so
// a tile is read front to back, in whole cache lines. Rows of V of all tiles form panels of 96 rows. A
// power-of-two scale a column keeps halfs in range and is folded into z = V w exactly.
//
// Every value is one chain of fused multiply-adds in the order of the columns: single frames, blocks of frames, all
// tiles or a list, and every SIMD target give the same bits. Allocates nothing; const functions may run on any thread.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "base/points.h"
#include "base/status.h"

namespace kpsa {

inline constexpr std::size_t kTilePoints = 128;
inline constexpr std::size_t kPanelPoints = 32;
inline constexpr std::size_t kBlockFrames = 4;  // frames that the kernel takes at a time

// 64-byte aligned storage of halfs or floats.
template <typename T>
class AlignedArray {
 public:
  AlignedArray() = default;
  explicit AlignedArray(std::size_t size) : floats_((size * sizeof(T) + 3) / 4), size_(size) {}
  T* data() { return reinterpret_cast<T*>(floats_.data()); }
  const T* data() const { return reinterpret_cast<const T*>(floats_.data()); }
  std::size_t size() const { return size_; }
  std::span<const T> span() const { return {data(), size_}; }
  std::span<T> span() { return {data(), size_}; }

 private:
  AlignedFloats floats_;
  std::size_t size_ = 0;
};

// The stored form of one output (one mesh). Plain arrays, as in the subspace file.
struct TileData {
  std::size_t points = 0;             // N
  int components = 3;                 // c
  std::size_t inputs = 0;             // r
  std::vector<std::uint32_t> ranks;   // [tiles] k, 1..r (0 for a tile that never moves)
  std::vector<std::uint8_t> direct;   // [tiles] 1: U is the product itself, z = w
  AlignedArray<std::uint16_t> v;      // [v panels][r][96] halfs: rows of V of all tiles that are not direct
  AlignedArray<std::uint16_t> u;      // [tile][panel][k][32c] halfs
  AlignedArray<float> mean;           // [panels][32c]
  AlignedArray<float> scale;          // [z] a power of two for every entry of z
};

class TileMap {
 public:
  TileMap() = default;
  // Checks all sizes, ranks and scales; errors name `what`.
  static Result<TileMap> Make(TileData data, const std::string& what);

  const TileData& data() const { return data_; }
  std::size_t points() const { return data_.points; }
  std::size_t inputs() const { return data_.inputs; }
  std::size_t tiles() const { return data_.ranks.size(); }
  std::size_t bytes() const;         // read for one frame
  double numbers_per_point() const;  // halfs of U and V
  double mean_rank() const;

  // Floats of scratch that `frames` frames need (any float buffer; 64-byte alignment is faster).
  std::size_t scratch_floats(std::size_t frames = 1) const;

  // w [r] -> all points.
  void Reconstruct(std::span<const float> w, std::span<float> scratch, PointsView out) const;
  // Only the tiles listed (ascending, none twice); other points are not touched.
  void ReconstructTiles(std::span<const float> w, std::span<const Index> tiles, std::span<float> scratch, PointsView out) const;
  // Frames: w [frames x r] row-major, one output each. `tiles` empty: all.
  void ReconstructBlock(std::span<const float> w, std::span<const PointsView> outs, std::span<const Index> tiles,
                        std::span<float> scratch) const;

 private:
  void Run(const float* w, std::size_t frames, const Index* tiles, std::size_t tile_count, float* scratch,
           const PointsView* outs) const;

  TileData data_;
  std::vector<std::size_t> z_begin_;  // [tiles] first entry of z
  std::vector<std::size_t> v_begin_;  // [tiles] first row among the V panels (not direct)
  std::vector<std::size_t> u_begin_;  // [tiles] first half of U
  std::size_t v_rows_ = 0, z_count_ = 0;
};

struct TileOptions {
  double rms_budget = 0;  // expected RMS point error that a tile may add, scene units; > 0
};
// What the factors cost in accuracy, under the model's covariance; scene units. Where half precision cannot keep the
// budget, worst_tile_rms exceeds it.
struct TileReport {
  double rms = 0, worst_tile_rms = 0;
  std::size_t direct_tiles = 0;
};
// gain: B W^-1 [cN x r] for whitened measurements; mean [cN] interleaved. Rows of one output.
TileMap BuildTiles(const Eigen::MatrixXd& gain, const Eigen::VectorXd& mean, int components, const TileOptions& options,
                   TileReport* report = nullptr);

// The dense float32 twin: the reference, and the choice where half precision or rank does not pay.
class DenseMap {
 public:
  DenseMap() = default;
  DenseMap(const Eigen::MatrixXd& gain, const Eigen::VectorXd& mean, int components);
  std::size_t points() const { return points_; }
  std::size_t inputs() const { return inputs_; }
  std::size_t bytes() const { return (matrix_.size() + mean_.size()) * sizeof(float); }
  void Reconstruct(std::span<const float> w, PointsView out) const;

 private:
  std::size_t points_ = 0, inputs_ = 0;
  int components_ = 3;
  AlignedArray<float> matrix_;  // [panels][r][32c]
  AlignedArray<float> mean_;    // [panels][32c]
};

// IEEE half precision, round to nearest even; overflow gives infinity.
std::uint16_t HalfFromFloat(float value);
float FloatFromHalf(std::uint16_t half);

}  // namespace kpsa
