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

// Which of the poses are of clips, the first ones, and which are folded (PosesFolded); all others are drawn.
struct PoseRanges {
  std::size_t clips = 0, folded_begin = 0, folded_end = 0;
  bool IsFolded(std::size_t pose) const { return pose >= folded_begin && pose < folded_end; }
};
// How far off a point may be in them. What is farther off in a folded pose than `turned` lies in a crease: its neighbours
// are that far off in other poses.
struct PoseBounds {
  double drawn = 0, clips = 0, folded = 0, turned = std::numeric_limits<double>::infinity();
};

// In which poses which points are farther off than that. Point k of tile t is number kTilePoints t + k.
class PointsBeyond {
 public:
  PointsBeyond() = default;
  PointsBeyond(std::size_t poses, std::size_t tiles, const PoseRanges& ranges, const PoseBounds& bounds);
  // errors: [n x poses], n of the tile. From any thread, another tile each.
  void Set(std::size_t tile, const Eigen::MatrixXd& errors);
  std::size_t poses() const { return poses_; }
  std::size_t tiles() const { return sizes_.size(); }
  std::size_t points() const;  // that were set

  // The fewest points, the worst first, without which at most that share of the poses has one beyond; ascending.
  std::vector<std::size_t> Worst(double share) const;
  // Those beyond PoseBounds::turned in a folded pose; ascending.
  std::vector<std::size_t> Turned() const;
  // As if no pose were folded.
  PointsBeyond WithoutFolded() const;

 private:
  std::size_t poses_ = 0, words_ = 0;
  PoseRanges ranges_;
  PoseBounds bounds_;
  std::vector<std::size_t> sizes_;   // [tiles] points of each
  std::vector<std::uint64_t> bits_;  // [points x words_], a bit a pose
  std::vector<char> turned_;         // [points]
};

// The last steps that points of tiles may go through instead.
struct TileSteps {
  std::vector<double> ns = {};  // by tile, what its step costs; 0: it has none; empty: none has
  double most = std::numeric_limits<double>::infinity();  // that all of them may cost
  double most_points = 1;                                 // of all points
};

// Points that a last step should give, and which of them lie in a crease; ascending.
struct Poor {
  std::vector<std::size_t> points = {}, turned = {};
  bool empty() const { return points.empty(); }
};
// The points that are beyond in any pose; none where these are too many, one of them has no step, or their steps cost too
// much. Of the tiles of `steps`, these are one of `every`; then they may cost less, since among the others there are more.
Poor PoorPoints(const PointsBeyond& beyond, const TileSteps& steps, std::size_t every = 1);

// By two bounds: those beyond the strict one, which keeps clips farther from the tolerance; where these are too many, cost
// too much or have no step, those beyond the other; and where that does not help either, the same without folded poses.
struct PointsOff {
  PointsBeyond strict, plain;
};
Poor PoorPoints(const PointsOff& off, const TileSteps& steps, std::size_t every = 1);

}  // namespace kpsa::engine
