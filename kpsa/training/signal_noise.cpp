#include "kpsa/training/signal_noise.h"

#include <algorithm>

#include "kpsa/training/cue_values.h"
#include "kpsa/training/pose_recorder.h"

namespace kpsa::engine {
namespace {

constexpr double kNoiseTurn = 1e-4;                        // of a joint
constexpr double kNoiseShare = 5e-3;                       // of the tolerance: a shift of a joint or a point
constexpr double kFactorTurn = 1e-2, kFactorValue = 1e-3;  // deviations of factors
constexpr double kFactorShift = 0.2;                       // tolerances: and of shifts

}  // namespace

CueNoise NoiseOf(std::span<const Signal> signals, const PoseMatrix& poses, const Eigen::VectorXd& mean,
                 double diagonal, double tolerance, bool of_light) {
  const PoseLayout& layout = poses.layout();
  CueNoise noise(diagonal);
  const double shift = kNoiseShare * tolerance;
  noise.point = std::max(noise.point, shift * shift);
  noise.scalars.assign(layout.scalars, 0);
  const std::vector<Index> first = FirstScalars(signals, layout);
  for (std::size_t s = 0; s < signals.size(); ++s) {
    if (!signals[s].matrix) continue;
    const double scale = signals[s].relative ? JointScale(poses, &mean, first[s]) : 1;
    for (Index e = 0; e < signals[s].entries(); ++e) {
      const double still = e < 9 ? scale * kNoiseTurn : of_light ? kLightShift : shift;
      noise.scalars[first[s] + e] = still * still;
    }
  }
  return noise;
}

CueProductOptions ProductOptionsOf(std::span<const Signal> signals, const PoseLayout& layout,
                                   double tolerance) {
  CueProductOptions options;
  options.most = layout.products;
  options.tolerance = tolerance;
  options.still.assign(layout.scalars, kFactorValue);
  const std::vector<Index> first = FirstScalars(signals, layout);
  for (std::size_t s = 0; s < signals.size(); ++s) {
    for (Index e = 0; e < signals[s].entries(); ++e) {
      const Index scalar = first[s] + e;
      if (signals[s].matrix) options.still[scalar] = e < 9 ? kFactorTurn : kFactorShift * tolerance;
      if (!signals[s].relative) options.factors.push_back(scalar);
      options.regressors.push_back(scalar);
    }
  }
  return options;
}

}  // namespace kpsa::engine
