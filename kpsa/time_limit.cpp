#include "kpsa/time_limit.h"

#include <algorithm>
#include <cmath>

#include "kpsa/gemm.h"

namespace kpsa {
namespace {

constexpr std::size_t kProbedPoses = 256, kLeastPosesWithin = 250;
constexpr double kOfGram = 8;  // training without cues of tiles, in Gram matrices of its poses

}  // namespace

double TimeLimit::elapsed() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
}

std::size_t PosesWithin(double seconds, const PoseMatrix& poses) {
  const std::size_t all = poses.poses(), probed = std::min(all, kProbedPoses);
  if (!std::isfinite(seconds) || all <= kLeastPosesWithin) return all;
  const TimeLimit clock(seconds);
  Gram(GemmOperand::Poses(poses, 0, probed, 0, poses.layout().outputs()));
  const double a_pair = clock.elapsed() / static_cast<double>(probed * probed);
  const double within = std::sqrt(std::max(0.0, seconds) / std::max(kOfGram * a_pair, 1e-15));
  return within >= static_cast<double>(all) ? all
                                            : std::max(kLeastPosesWithin, static_cast<std::size_t>(within));
}

}  // namespace kpsa
