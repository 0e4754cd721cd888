// Cues of each tile alone, instead of some for all points: a tile is nearly
// linear in the world matrices of the joints that move it, and in a few values; what these leave is told by
// points before the deformers that spread (a deltaMush), near the tile. All of these, and the tile itself,
// are taken relative to the space of the points, or to the joint that carries the tile: there little is left
// of what the joints above do, and what bends the tile is told by few numbers. Each tile gets a ridge
// regression on what is its own, so that no number of modes limits it.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "kpsa/training/cue_selection.h"
#include "kpsa/training/poor_points.h"
#include "kpsa/training/pose_matrix.h"
#include "kpsa/training/tile_builder.h"

namespace kpsa::engine {

// What may be measured for a tile.
struct TileCandidates {
  std::size_t first_column = 0, height = 0;  // of the poses: the points of the tile [3n]
  std::vector<Index> joints;                 // that move it: scalar of the first entry of the relative matrix
  std::vector<CueRef> points;                // those of the tile, and near it
  std::size_t own_points = 0;                // the first ones are the tile's
  bool before_step = false;                  // it gives what a last step reads, too
};

struct TileCueOptions {
  double tolerance = 1e-4;                // scene units
  const Eigen::VectorXd* mean = nullptr;  // of the poses' columns
  PoseRanges ranges;                      // of the poses
  std::vector<CueRef> values;             // that may move any tile: weights of morph targets, envelopes
  double turn_reach = 0;  // scene units that an entry of a rotation, or a value, moves points, about
};

// The chosen ones, none twice, and which of them each tile reads.
struct TileCues {
  std::vector<CueRef> cues;
  std::vector<std::vector<std::uint32_t>> of_tile;  // into cues, ascending
  std::vector<Index> joint;  // [tiles] of TileCandidates::joints, or kNoIndex: the tile stays in the space
};
// poses: centred. Splits over threads; the result does not depend on how many.
TileCues ChooseTileCues(const PoseMatrix& poses, std::span<const TileCandidates> tiles,
                        const TileCueOptions& options);

// The linear map of a tile from some rows of y: ridge, with the penalty that serves poses best that are not
// fitted to; then poses with large errors count more. measured: y of the poses [r x T]; set: its cues.
TileModel FitTile(const PoseMatrix& poses, const Eigen::MatrixXd& measured, const CueSet& set,
                  const TileCueOptions& options, const TileCandidates& tile, Index joint,
                  std::vector<std::uint32_t> columns);
// Its target and its mean, which do not depend on what is measured.
void SetTarget(const PoseMatrix& poses, const TileCueOptions& options, const TileCandidates& tile,
               Index joint, TileModel* model);

}  // namespace kpsa::engine
