// Points of a tile that no map from cues tells as the tolerance asks, since a deltaMush turns their frames over: the
// points before its last step (graph/last_step.h), which are nearly linear in what the tile reads, are reconstructed
// instead, and the step gives the points. A few of a mesh; training finds them (kpsa/training/mend_tiles.h).
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "base/points.h"
#include "base/status.h"
#include "graph/last_step.h"
#include "kpsa/tiles.h"

namespace kpsa::engine {

struct TileMend {
  Index output = 0, tile = 0;
  std::vector<Index> points;  // that are mended, of the mesh and in the tile, ascending
  std::vector<Index> inner;   // what the step reads for them, ascending
  // Inner points, x of all, then y and z, in the space of the tile's joint if it has one:
  // mean + sum over the cues j that the tile reads of y_j map[j].
  std::vector<float> mean;  // [3 inner]
  std::vector<float> map;   // [cues of the tile][3 inner]
  friend bool operator==(const TileMend&, const TileMend&) = default;
};

inline constexpr std::size_t kMaxMends = 1u << 12;  // of a subspace

// tiles: of all outputs. Errors: lists that do not count up, numbers beyond what there is, or not finite.
Status CheckMends(std::span<const TileMend> mends, std::span<const TileMap> tiles);

// Those of one output, for the points that a request wants. Refers to the mends. Immutable, any thread.
class BoundMends {
 public:
  BoundMends() = default;
  // step: of all points of the output.
  BoundMends(std::span<const TileMend> mends, const TileMap& tiles, Index output, const PointSet& wanted,
             const LastStep& step);
  bool empty() const { return parts_.empty(); }
  std::size_t scratch_floats() const { return scratch_; }
  // y: what is measured. out: the wanted points, of which some are replaced. world_from_space: null where points come
  // out in the space. scratch: aligned to 64 bytes. Allocates nothing.
  void Run(const TileMap& tiles, const float* y, const Matrix4* world_from_space, PointsView out,
           std::span<float> scratch) const;

 private:
  struct Part {
    const TileMend* mend;
    std::shared_ptr<const LastStep::Bound> step;
    std::vector<Index> places;  // among the wanted points
  };
  std::vector<Part> parts_;
  std::size_t inner_points_ = 0, scratch_ = 0;
};

}  // namespace kpsa::engine
