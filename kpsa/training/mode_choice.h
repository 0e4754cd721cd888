// How many modes to keep where poses are noisy: light by path tracing, and the rounding of points that
// nothing moves in their space. There every further mode lowers what training leaves over and, from some
// number on, learns the noise of the training poses; then the estimator trusts its cues too much and fails on
// new poses.
#pragma once

#include <vector>

#include "kpsa/training/cue_selection.h"
#include "kpsa/training/pose_matrix.h"

namespace kpsa::engine {

// Whether what all points together move by is far below the tolerance (scene units), so that modes would be
// of rounding: the space carries the points.
bool IsStill(const Pca& pca, double tolerance);

// The smallest number of modes whose MAP estimate from `cues` (any good spread of them) comes within 1 % of
// the least RMS error on `judges`: poses centred with pca.mean that the PCA has not seen. The noise of a
// cue is what that many modes leave over, as of HonestResidual. The modes must be orthonormal over the
// outputs.
Eigen::Index ChooseModeCount(const Pca& pca, std::span<const CueRef> cues, const CueNoise& noise,
                             const PoseMatrix& judges);

// What `modes` of `poses` training poses leave unexplained, for poses that were not trained on: training
// spends a degree of freedom a mode.
double HonestResidual(double residual, std::size_t poses, Eigen::Index modes);

// `count` of `total` points, spread so that no row or column of a picture is preferred: steps of the golden
// ratio. Ascending, none twice.
std::vector<Index> GoldenSpread(std::size_t total, std::size_t count);
// As many in even steps, each in the middle of its share. Ascending, none twice.
std::vector<Index> EvenSpread(std::size_t total, std::size_t count);

}  // namespace kpsa::engine
