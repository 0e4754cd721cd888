// Reconstruction at run time: x = mean + U (V y_J), tile by tile, with float32 accumulation. Glossary: y the
// r normalised measurements (kpsa/training/cue_selection.h), a tile 128 points in the order given, J the cues
// that the tile reads, k its rank, P panels of 32 points, c components (3 or 1).
//
// The estimator's map B [cN x r] is dense, but the points of a tile hardly depend on most cues. For each tile
// the few cues J are chosen that predict what B says (greedy, by the fall of the expected squared error under
// the covariance of y), the best linear map from those is computed anew, and factored by a truncated SVD in
// output units. Budgets: the RMS that this may add under the covariance of y, and the largest error that it
// may add in sample poses: covariances say little about controls that move rarely, but far, so poses with too
// large an error are given weight until they fit. Where the factors are no smaller than their product, that
// is stored (a "direct" tile).
//
// The bytes that are read, and their conversions, bound the speed. So U is stored in bytes, and summed in
// integers: column k of U is a scale and whole numbers in [-127, 127], or in [-32639, 32639] where the budget
// sees the rounding (a "wide" column, stored as two: high and low bytes). The inputs z of the bytes are
// rounded to 16 bits with a step that follows from the largest of them in this frame, and the sums are exact.
// V is stored in halfs. Layout of U: panels of 32c rows (32 points' x, then y, z), groups of four byte
// columns (those of a group in the places 0, 2, 1, 3), and the four bytes of a row together, each 128 too large. Everything is read front to back, tile
// after tile.
//
// A tile may have products (kpsa/training/tile_products.h): z = V y_J, its first latents whitened and
// clipped, p = 1 and products of pairs of these, x = mean + U (z + W p). W is stored as V is. What the
// products add says how far a pose is from where the linear map was good: for a few points of the tile it is
// computed apart, the doubt.
//
// A tile may lie in the space of a joint: what bends it is then told by few cues, whatever the joints above
// do, and its points go through the world matrix of the joint, relative to the space of the points, which is
// among the cues (twelve rows).
//
// All floating-point values are computed in a fixed order: single frames, blocks of frames, all tiles or a
// list, and every SIMD target give the same bits. Allocates nothing; const functions may run on any thread. A
// NaN or an infinity in a cue that a tile reads spoils the points of the tile.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/digest.h"
#include "base/points.h"
#include "base/status.h"
#include "base/types.h"
#include "kpsa/aligned_array.h"

namespace kpsa::engine {

inline constexpr std::size_t kTilePoints = 128;
inline constexpr std::size_t kPanelPoints = 32;
inline constexpr std::size_t kMaxTileRank = 256;
inline constexpr std::size_t kBlockFrames = 4;     // frames that the kernel takes at a time
inline constexpr std::size_t kLatents = 12;        // whose products a tile may have, at most
inline constexpr float kLatentClip = 6;            // deviations
inline constexpr std::size_t kDoubtPoints = 5;     // of a tile
inline constexpr std::size_t kMaxTileJoints = 64;  // of one output

// The stored form of one output (one mesh). Plain arrays, as in the subspace file.
struct TileData {
  std::size_t points = 0;            // N
  int components = 3;                // c
  std::size_t inputs = 0;            // r
  std::vector<std::uint32_t> ranks;  // [tiles] k, at most kMaxTileRank (0 for a tile that never moves)
  std::vector<std::uint32_t> wide;  // [tiles] columns of U with two bytes a number, the first ones; at most k
  std::vector<std::uint32_t> counts;  // [tiles] |J|, at most r
  std::vector<std::uint8_t>
      direct;  // [tiles] 1: U is the product itself, k = |J|, z = scale y_J entry by entry
  std::vector<std::uint32_t>
      columns;                // [sum of counts] J of each tile, in the order of V's (direct: of U's) columns
  AlignedArray<float> scale;  // [tile][k16], k16 = k to the next multiple of 16: z = scale V y_J
  AlignedArray<std::uint16_t> v;  // [tile][|J|][k16] halfs; nothing for direct tiles
  AlignedArray<std::uint8_t> u;   // [tile][panel][(k + wide) / 4, rounded up][32c][4] U + 128: high bytes of
                                  // the wide columns, their low bytes, the other columns
  AlignedArray<float> mean;       // [panels][32c]
  // Products: nothing, or of every tile; the arrays below hold the tiles that have some, one after the other.
  std::vector<std::uint32_t> products;  // [tiles] P, at most kMaxProducts; 0: none
  std::vector<std::uint8_t>
      pairs;                      // [P][2] latents below min(k, kLatents), or kUnitLatent, which stands for 1
  AlignedArray<float> whitening;  // [32] what the latents are multiplied by; the scale of the doubt
  AlignedArray<std::uint16_t> w;  // [P][k16] halfs: z = scale (V y_J + W p)
  AlignedArray<std::uint16_t> doubt;  // [P][16] halfs: x, y, z of kDoubtPoints points
  // Joints: nothing, or of every tile 0, or 1 + the joint whose space it lies in. Of each joint the rows of y
  // that are its matrix, column by column (kpsa/signals.h): entry = mean + deviation y.
  std::vector<std::uint32_t> joints;                // [tiles]
  std::vector<std::uint32_t> joint_rows;            // [joints][12]
  std::vector<double> joint_mean, joint_deviation;  // likewise
};
inline constexpr std::size_t kMaxProducts = 1 + kLatents * (kLatents + 1) / 2;
inline constexpr std::uint8_t kUnitLatent = 15;  // which is 1

// The largest product term of the points that are watched (scene units), as far as it is believed
// (kpsa/training/tile_trust.h), and its tile.
struct Doubt {
  float largest = 0;
  Index tile = kNoIndex;
};

struct TileTerms;  // kpsa/tile_inputs.h

class TileMap {
 public:
  TileMap() = default;
  // Checks all sizes, ranks and columns; errors name `what`. known: a digest that stands for the data, where one is known.
  static Result<TileMap> Make(TileData data, const std::string& what,
                              const std::optional<Digest>& known = std::nullopt);

  const TileData& data() const { return data_; }
  // Maps of the same digest are the same; those of a file and of what it was written from have others.
  Digest digest() const;
  std::size_t points() const { return data_.points; }
  std::size_t inputs() const { return data_.inputs; }
  std::size_t tiles() const { return data_.ranks.size(); }
  std::size_t bytes() const;  // read for one frame
  double bytes_per_point() const;
  double mean_rank() const;
  double mean_cues() const;                                        // |J|
  std::span<const std::uint32_t> CuesOf(std::size_t tile) const {  // J
    return {data_.columns.data() + column_begin_[tile], data_.counts[tile]};
  }
  // The matrix of the joint that the tile lies in, relative to the space of the points; false where it lies in that.
  bool JointOf(std::size_t tile, const float* y, Matrix4* joint) const;
  bool has_products() const { return !data_.products.empty(); }
  // The same with doubts that many times as large. [tiles()]
  TileMap WithDoubts(std::span<const double> factors) const;

  // y [r] -> all points, in the space of the mean, or through `space`: a tile at a time, as long as it is in
  // the cache.
  void Reconstruct(std::span<const float> y, PointsView out, const Matrix4* space = nullptr) const;
  // Frames: y [frames x r] row-major, one output each, and one space each or none. Only the tiles listed
  // (ascending, none twice; other points are not touched); empty: all. places: where the points of each of these go,
  // multiples of 16; empty: where they stand.
  void ReconstructBlock(std::span<const float> y, std::span<const PointsView> outs,
                        std::span<const Index> tiles, std::span<const Matrix4> spaces = {},
                        std::span<const Index> places = {}) const;
  // What U of every tile is multiplied by [input_size()], so that what the doubt needs is computed once; and
  // the largest doubt, for y that are finite: 0 and no tile without products.
  std::size_t input_size() const { return data_.scale.size() + (data_.joint_rows.size() + 15) / 16 * 16; }
  // doubts: of every tile [tiles()], or empty.
  Doubt ComputeInputs(std::span<const float> y, std::span<float> inputs, std::span<float> doubts = {}) const;
  // ReconstructBlock from these; as many of them as frames. The same bits.
  void ReconstructFrom(std::span<const float* const> inputs, std::span<const PointsView> outs,
                       std::span<const Index> tiles, std::span<const Matrix4> spaces = {},
                       std::span<const Index> places = {}) const;

 private:
  struct Place {  // of a tile in the arrays of products
    std::size_t pairs = 0, lanes = 0, whitening = 0, w = 0, doubt = 0;
  };
  Status PlaceProducts(const TileData& data, const std::string& what);
  std::size_t products(std::size_t tile) const { return data_.products.empty() ? 0 : data_.products[tile]; }
  void SetTerms(std::size_t tile, float* z, float* doubt, TileTerms* terms) const;
  Status CheckJoints(const TileData& data, const std::string& what) const;
  void JointMatricesOf(const float* y, float* entries) const;  // [joints][12]
  // The tiles listed (none: all) of some frames; inputs_of(tiles, frame, space, t): where the inputs of
  // a few tiles are, perhaps in `space`. joints_of(frame, entries): as JointMatricesOf.
  template <typename InputsOf, typename JointsOf>
  void Run(const InputsOf& inputs_of, const JointsOf& joints_of, std::span<const PointsView> outs,
           std::span<const Index> tiles, std::span<const Matrix4> spaces,
           std::span<const Index> places) const;

  TileData data_;
  std::optional<Digest> known_digest_;
  std::vector<std::size_t> column_begin_;  // [tiles] first of columns
  std::vector<std::size_t> scale_begin_;   // [tiles] first of scale
  std::vector<std::size_t> v_begin_;       // [tiles] first half of V
  std::vector<std::size_t> u_begin_;       // [tiles] first byte of U
  std::vector<Place> product_begin_;       // [tiles] or empty
  AlignedArray<std::uint8_t> lanes_;       // pairs as kpsa/tile_inputs.h reads them
};

// IEEE half precision, round to nearest even; overflow gives infinity.
std::uint16_t HalfFromFloat(float value);
float FloatFromHalf(std::uint16_t half);

}  // namespace kpsa::engine
