// The SoftCache threshold from a tolerance in scene units. A frame violates if it is accepted although a
// point of what is emitted, blends included, is farther than the tolerance from the exact result. Calibration
// poses are of several kinds (PoseKind); among those whose thresholds satisfy all of the following, the
// largest is taken:
//   of each kind, the rate of violations is at most alpha with 90 % confidence (exact binomial bound),
//   of all, the same of 2 alpha among hits, and (violations + 1) <= 2 alpha (hits + 1); of each kind that has
//   any among what is accepted, since violations are counted there: beyond the ranges most of that is blends;
//   where patches miss by themselves, of all among what is accepted, too,
//   of all, violations beyond 3 tolerances keep alpha / 10 likewise;
//   it is not beyond a score from which on most poses within the ranges are wrong, even if they are few.
// The confidence is over the draw of the calibration poses: nine of ten trainings keep their rate, where
// conformal risk control (arXiv 2208.02814) keeps it on the average over trainings. It is about poses that
// are exchangeable with those of a kind; for single neighbouring frames of a clip it claims nothing.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "kpsa/soft_cache.h"

namespace kpsa::engine {

inline constexpr double kCalibrationConfidence = 0.9;
inline constexpr double kSevere = 3;         // tolerances: a violation beyond them is a severe one
inline constexpr double kSevereShare = 0.1;  // of alpha: what may be severe
inline constexpr double kShareOfHits = 2;    // in alphas: violations among the hits
inline constexpr double kMostBeyondSeen = 1.5;

// The guard of a pose of which guards ask for patches alone: no hit, and nothing of the others is asked for.
inline constexpr double kSomeGuard = 1e-12;

// One patch of a pose (kpsa/patches.h): its own score, the largest error of its points, and what guards ask
// of it.
struct PatchPair {
  double score = 0, error = 0, guard = 0;
  friend bool operator==(const PatchPair&, const PatchPair&) = default;
};

// One calibration pose.
struct CalibrationPair {
  double score = 0;
  double error = 0;  // largest point error of the pure reconstruction, scene units; of light the RMS over an
                     // output's points, the largest of all outputs
  double guard = 0;  // share of the full evaluation that the guards ask for (GuardWeight)
  int kind = 0;      // PoseKind (kpsa/pose_kind.h)
  // Where patches miss by themselves: those that no other one outdoes with a lower score, a lower guard and a
  // larger error, by score; and the score that half of all patches reach, from which on all points are exact
  // (AllWeight).
  std::vector<PatchPair> patches = {};
  double middle = 0;
  bool near_clips = false;  // SampledPose::near_clips, of the sampled kind: hits of these are those to expect
  // PatchLayout::blends_only: patches have their own scores, and `middle` is that of the pose.
  bool blends_only = false;
};
// Keeps what CalibrationPair::patches says, of the patches of a pose in any order.
std::vector<PatchPair> OutstandingPatches(std::vector<PatchPair> patches);

struct Calibration {
  SoftCacheThreshold threshold;
  double alpha = 0;                            // as asked
  double attainable_alpha = 0;                 // what the number of poses can promise: alpha, or more
  double attainable_severe = 0;                // the same of severe violations: alpha / 10, or more
  double confidence = kCalibrationConfidence;  // as asked
  bool enough_poses = true;                    // attainable_alpha is alpha
  std::size_t poses = 0;                       // n
  // On the calibration poses themselves, at this threshold:
  struct Kind {
    int kind = 0;
    std::size_t poses = 0, hits = 0, accepted = 0, violations = 0;
    double upper_bound = 0;  // of the rate of violations, with `confidence`
  };
  std::vector<Kind> kinds;                                         // by kind
  std::size_t near_clips = 0, hits_near_clips = 0;                 // of them, CalibrationPair::near_clips
  std::size_t hits = 0, accepted = 0, violations = 0, severe = 0;  // of all
  double hit_rate = 0;                                             // of all: score <= tau_lo and no guard
  double accepted_rate = 0;                                        // of all: the full evaluation is not alone
  double upper_bound = 0;                                          // the largest of the kinds'
  std::size_t worst = kNoPose;  // the accepted pose with the largest emitted error, and that error
  double worst_error = 0;
  std::string warning;  // not empty: what could not be met
  static constexpr std::size_t kNoPose = ~std::size_t{0};
};

// tolerance 0 or less: never hit; infinite: always. blend_start is c in (0, 1]. Where no pose forbids it, tau
// ends at the largest calibration score / c, as beyond what was seen nothing is promised; but where all that was
// seen is right, by a margin, this reaches farther by the root of tolerance / largest error, up to kMostBeyondSeen
// times. A score is a distance from what was trained on, or what products of its cues make (second order), so the
// square is cautious. Pairs with a NaN count as violations. A larger tolerance never gives a smaller threshold.
Calibration Calibrate(std::span<const CalibrationPair> pairs, double tolerance, double alpha,
                      double blend_start = kBlendStart, double confidence = kCalibrationConfidence);

// Share of the full evaluation, and largest point error, of what is emitted. Where patches miss by themselves
// the share is 0 for a hit, 1 where all points are exact, and anything between for the rest.
double EmittedWeight(const CalibrationPair& pair, const SoftCacheThreshold& threshold);
double EmittedError(const CalibrationPair& pair, const SoftCacheThreshold& threshold);

// Of held-out poses that are made of frames of the training clips, as other clips may be; where there are
// none, of poses as the sampler draws them; of all where there are no kinds.
double ExpectedHitRate(const Calibration& calibration);

}  // namespace kpsa::engine
