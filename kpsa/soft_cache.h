// SoftCache: how far a measurement is from what the subspace was trained on, and what to do about it.
// Glossary: y the r normalised measurements, G their covariance, F the factor: W with W^T W = G^-1, lower
// triangular (map), or Q^T, the M orthonormal rows that span what the modes do to the cues (paper: far fewer
// numbers than the projector I - Q Q^T); g = F^T F y (map), or the residual y - F^T F y = y - C p (paper).
//
// map:   score 1 = |F y|^2 (residual and Mahalanobis distance in one); score 2 = the largest leave-one-out error
//        of a cue, |([G^-1]_ii)^-1 g_i| with the block of the cue; each over its 99 % training quantile; the
//        larger counts.
// paper: |y - C p| over its 99 % training quantile.
// F is read once, four rows at a time: w = F y gives the four values that the same rows then add to g.
//
// Below tau_lo = c tau: a hit. Between tau_lo and tau: a stateless smoothstep blends the full evaluation in.
// Above: the full evaluation alone. Frames therefore do not depend on their order. Guards are such ramps,
// too; the largest weight counts.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "base/scalar_math.h"
#include "base/types.h"
#include "kpsa/aligned_array.h"

namespace kpsa::engine {

// How the subspace's numbers follow from the measured ones (kpsa/training/estimator.h).
enum class EstimatorMode : std::uint8_t { kMap, kPaper };

// Why the full evaluation is needed.
enum class MissReason : std::uint8_t {
  kNone,        // a hit
  kScore,       // the score is above tau_lo; `offender` is the cue of the largest leave-one-out error
  kNotFinite,   // a measurement is NaN, infinite or huge; `offender` is its cue
  kOutOfRange,  // a value is outside its trained range; `offender` is its guard
  kNeverHit,    // the tolerance is zero, or no threshold keeps the violation rate
  kDoubt,       // what a tile's products say is above tau_lo; `offender` is the tile (kpsa/subspace.h)
  kSpace,       // the space is stretched, mirrored or scaled as it was not in training
  kManyAtOnce,  // more is far out of rest at once than in poses that frames are like (kpsa/activity.h)
};

struct Verdict {
  double score = 0;
  double full_weight = 0;  // share of the full evaluation in the result: 0 for a hit, 1 for a full miss
  bool hit = true;         // the full evaluation is not needed at all
  MissReason reason = MissReason::kNone;
  Index offender = kNoIndex;
};

inline constexpr double kBlendStart = 0.85;  // c, unless something else is asked for

// What decides; from kpsa/calibration.h. tau < 0: nothing is ever a hit; infinity: everything finite is.
struct SoftCacheThreshold {
  double tau = -1;
  double blend_start = kBlendStart;  // c
  double tau_lo() const { return tau * blend_start; }
};

// Share of the full evaluation at a score.
double FullWeight(double score, const SoftCacheThreshold& threshold);

// What counts of a patch of points whose own score is `own` where misses are of all points
// (PatchLayout::blends_only), and a pose's score is `score` >= own: at tau_lo the patch's own, at tau that of the
// pose, and between them own / (1 - t), t being how far the score is on its way from tau_lo to tau.
double PatchScoreInBlend(double own, double score, const SoftCacheThreshold& threshold);
// The least share of a pose's score that counts as a patch's own: all patches come in before tau.
inline constexpr double kLeastOwn = 0.15;

// The immutable data. Plain arrays: it is stored in the subspace file.
struct SoftCacheModel {
  EstimatorMode mode = EstimatorMode::kMap;
  std::size_t modes = 0;       // M; paper mode: rows of F
  std::vector<Index> offsets;  // [K + 1] rows of each cue
  AlignedArray<float>
      factor;  // F: for every 4 rows their groups of 16 columns (map: up to the diagonal), 4 x 16 each
  std::vector<float>
      leave_one_out;  // blocks ([G^-1]_ii)^-1, h x h each, one after the other (map mode; else empty); those of
                      // scalars times the displacement that they stand for
  double quantile1 = 1, quantile2 = 1;  // 99 % training quantiles of the raw scores, > 0
  std::size_t rows() const { return offsets.empty() ? 0 : offsets.back(); }
  std::size_t padded_rows() const { return (rows() + 15) / 16 * 16; }
  std::size_t factor_size() const;  // what `factor` has to hold
  std::size_t cues() const { return offsets.empty() ? 0 : offsets.size() - 1; }
};

struct RawScores {
  double score1 = 0, score2 = 0;  // before division by the quantiles; score2 is 0 in paper mode
  Index worst_cue = kNoIndex;     // of score 2; in paper mode of the largest residual
};
// Run time. y and g of at least padded_rows() floats, y with zeros beyond its rows; allocates nothing; the
// same bits on every SIMD target.
RawScores ComputeRawScores(const SoftCacheModel& model, std::span<const float> y, std::span<float> g);
// The score, times its weight, and what follows from it. NaN or infinity in y is a miss.
Verdict Judge(const SoftCacheModel& model, const SoftCacheThreshold& threshold, std::span<const float> y,
              std::span<float> g, double weight = 1);
// A hit of score 0, or a miss where y is not finite or so large that points would not be.
Verdict JudgeFinite(const SoftCacheModel& model, std::span<const float> y);

inline constexpr std::uint64_t kAllPatches = ~std::uint64_t{0};

// The trained range of a plug that may vary, and how far outside of it the full evaluation comes in.
struct TrainedRange {
  std::string plug;
  double lo = 0, hi = 0;  // seen in training, or too near to it to matter
  double ramp = 0;  // from lo - ramp down and hi + ramp up nothing but the full evaluation is left, >= 0
  std::uint64_t patches = kAllPatches;  // that it speaks of, a bit each (kpsa/patches.h)
  // What it is at rest, and how far from there training went, or 0 where that hardly moved a point (kpsa/activity.h)
  double rest = 0, reach = 0;
  double per_reach() const { return reach > 0 ? 1 / reach : 0; }
};
// [min, max] widened on both sides by `slack` (what moves no point noticeably) and by rounding (1e-6 of the
// magnitude, of at least 1: an entry that rested at 0 in training may come out as 1e-11).
TrainedRange MakeTrainedRange(std::string plug, double min, double max, double slack, double ramp);
// Share of the full evaluation that a guard asks for: 0 within [lo, hi] and up to a tenth of the ramp beyond, a smoothstep
// over the rest of it, 1 from there on; NaN gives 1. Stateless, like the score's. A share of a thousandth costs a
// full evaluation, and shows nothing.
inline constexpr double kForgivenOfRamp = 0.1;
inline double GuardWeight(double lo, double hi, double ramp, double value) {
  const double outside = value < lo ? lo - value : value - hi, forgiven = kForgivenOfRamp * ramp;
  if (outside <= 0) return 0;
  if (!(outside < ramp)) return 1;
  return outside <= forgiven ? 0 : Smoothstep((outside - forgiven) / (ramp - forgiven));
}
// "head.rotateX = 1.2 is outside its trained range [-0.5, 0.5]"
std::string OutsideMessage(const TrainedRange& range, double value);

}  // namespace kpsa::engine
