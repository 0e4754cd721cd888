// What of a signal is no motion: below it, a cue is not trusted, and no product is made of it. Internal to
// training.
#pragma once

#include <span>

#include "kpsa/signals.h"
#include "kpsa/training/cue_products.h"
#include "kpsa/training/cue_selection.h"

namespace kpsa::engine {

inline constexpr double kLightShift = 1e-4;  // of light: metres that no one would see a joint move

// poses: centred with mean; diagonal: of the model; tolerance: scene units, as the diagonal.
CueNoise NoiseOf(std::span<const Signal> signals, const PoseMatrix& poses, const Eigen::VectorXd& mean,
                 double diagonal, double tolerance, bool of_light);
// Every value is a regressor; of the matrices, only local ones have factors.
CueProductOptions ProductOptionsOf(std::span<const Signal> signals, const PoseLayout& layout,
                                   double tolerance);

}  // namespace kpsa::engine
