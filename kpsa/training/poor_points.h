// Points that the maps of their tiles do not tell, so that a last step (graph/last_step.h) should give them instead:
// mostly few, where a deltaMush turns frames over. Internal to training.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <vector>

namespace kpsa::engine {

// Of the poses: so few of them hardly matter.
inline constexpr double kFewBeyond = 0.005;
// Of the points: so few may be to blame that the others are worth their time
inline constexpr double kMostPoor = 1.0 / 3;

// In which poses which points are farther off than some bound. Point k of tile t is number kTilePoints t + k.
class PointsBeyond {
 public:
  PointsBeyond() = default;
  PointsBeyond(std::size_t poses, std::size_t tiles);
  // errors: [n x poses], n of the tile. bound_of_clips: of the first poses, which are of clips. From any thread, another
  // tile each.
  void Set(std::size_t tile, const Eigen::MatrixXd& errors, double bound, double bound_of_clips,
           std::size_t clip_poses);
  std::size_t poses() const { return poses_; }
  std::size_t tiles() const { return sizes_.size(); }
  std::size_t points() const;  // that were set

  // The fewest points, the worst first, without which at most that share of the poses has one beyond; ascending.
  std::vector<std::size_t> Worst(double share) const;

 private:
  std::size_t poses_ = 0, words_ = 0;
  std::vector<std::size_t> sizes_;   // [tiles] points of each
  std::vector<std::uint64_t> bits_;  // [points x words_], a bit a pose
};

// The last steps that points of tiles may go through instead.
struct TileSteps {
  std::vector<double> ns = {};  // by tile, what its step costs; 0: it has none; empty: none has
  double most = std::numeric_limits<double>::infinity();  // that all of them may cost
  double most_points = 1;                                 // of all points
};

// The points that are beyond in any pose; none where these are too many, one of them has no step, or their steps cost too
// much. Of the tiles of `steps`, these are one of `every`; then they may cost less, since among the others there are more.
std::vector<std::size_t> PoorPoints(const PointsBeyond& beyond, const TileSteps& steps,
                                    std::size_t every = 1);

// By two bounds: those beyond the strict one, which keeps clips farther from the tolerance; where these are too many, cost
// too much or have no step, those beyond the other.
struct PointsOff {
  PointsBeyond strict, plain;
};
std::vector<std::size_t> PoorPoints(const PointsOff& off, const TileSteps& steps, std::size_t every = 1);

}  // namespace kpsa::engine
