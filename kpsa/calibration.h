// The SoftCache threshold from a tolerance in scene units: conformal risk control (Angelopoulos et al. 2022,
// arXiv 2208.02814). A frame violates if it is accepted although a point of what is emitted, blend included,
// is farther than the tolerance from the exact result. Among n calibration poses the largest tau is taken for
// which
//   (violations(tau) + 1) / (n + 1) <= alpha   and   violations(tau) <= 2 alpha hits(tau).
// The second keeps a subspace that hardly ever hits from spending the whole allowance on its few hits.
// The rate then holds in expectation for poses that are exchangeable with the calibration poses (held-out
// sampled poses, or blocks of a second or more with gaps); for single neighbouring frames it claims nothing.
#pragma once

#include <span>
#include <string>

#include "kpsa/soft_cache.h"

namespace kpsa {

// One calibration pose: its score, and the largest point error of the pure reconstruction (before blending).
struct CalibrationPair {
  double score = 0;
  double error = 0;  // scene units; of light the RMS over an output's points, the largest of all outputs
};

struct Calibration {
  SoftCacheThreshold threshold;
  double alpha = 0;             // as asked
  double attainable_alpha = 0;  // max(alpha, 1 / (n + 1)): what the number of poses can promise
  bool enough_poses = true;     // false: n < 1 / alpha - 1; the threshold keeps attainable_alpha
  std::size_t poses = 0;        // n
  // On the calibration poses themselves, at this threshold:
  std::size_t violations = 0;
  double hit_rate = 0;       // share with score <= tau_lo
  double accepted_rate = 0;  // share with score < tau
  std::string warning;       // not empty: what could not be met
};

// tolerance 0 or less: never hit; infinite: always. blend_start is c in (0, 1]. Where no pose forbids it, tau
// ends at the largest calibration score / c: beyond what was seen nothing is promised. Pairs with a NaN count
// as violations.
Calibration Calibrate(std::span<const CalibrationPair> pairs, double tolerance, double alpha,
                      double blend_start = 0.85);

// Largest point error of what is emitted at this score.
double EmittedError(const CalibrationPair& pair, const SoftCacheThreshold& threshold);

}  // namespace kpsa
