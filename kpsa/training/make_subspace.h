// From a trained estimator to what plays (kpsa/subspace.h): SoftCache and tiles.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "kpsa/subspace.h"
#include "kpsa/training/cue_selection.h"
#include "kpsa/training/estimator.h"
#include "kpsa/training/pca.h"
#include "kpsa/training/tile_builder.h"

namespace kpsa::engine {

// From an estimator; the quantiles from training measurements, one a column [r x T].
SoftCacheModel MakeSoftCacheModel(const Estimator& estimator, const CueSet& cues,
                                  const Eigen::MatrixXd& training);

// Tiles and SoftCache of a trained estimator (without its gain: by latent coordinates); rows of the PCA's
// outputs are split over `outputs`. training: y of the training poses [r x T]; where the poses themselves are
// given, centred, tiles get products, and the score counts what these say. The caller fills cues,
// calibration, ranges and names.
Subspace MakeSubspace(const Pca& pca, const CueSet& cues, const Estimator& estimator,
                      const Eigen::MatrixXd& training, std::vector<SubspaceOutput> outputs,
                      const TileOptions& options, const PoseMatrix* poses = nullptr,
                      std::size_t clip_poses = 0);

// Bytes that a frame reads of the tiles of MakeSubspace, about: by one of `every` tiles. 0: there are too few to tell.
double BytesOfTiles(const Pca& pca, const Estimator& estimator, const Eigen::MatrixXd& training,
                    const std::vector<SubspaceOutput>& outputs, const TileOptions& options,
                    const PoseMatrix* poses, std::size_t clip_poses, std::size_t every);

// Some of the training poses, evenly spread: they watch the largest errors of tiles.
Eigen::MatrixXd SampledColumns(const Eigen::MatrixXd& training);

// Subspace::kept_modes.
ModeMatrix KeptModesOf(const Pca& pca);

}  // namespace kpsa::engine
