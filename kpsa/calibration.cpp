#include "kpsa/calibration.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>
#include <vector>

#include "base/scalar_math.h"
#include "kpsa/binomial.h"
#include "kpsa/pose_kind.h"

namespace kpsa::engine {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// u in [0, 1] with smoothstep(u) = w.
double InverseSmoothstep(double w) {
  double lo = 0, hi = 1;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (lo + hi);
    (Smoothstep(middle) < w ? lo : hi) = middle;
  }
  return hi;
}

// The largest tau at which points are no farther than the tolerance: the blend then takes just enough of the
// full evaluation.
double LargestHarmless(double score, double error, double guard, double tolerance, double blend_start) {
  if (std::isnan(score) || std::isnan(error) || std::isnan(guard)) return 0;
  if ((1 - guard) * error <= tolerance) return kInfinity;
  const double u = error == kInfinity ? 1 : InverseSmoothstep(1 - tolerance / error);
  return score / (blend_start + u * (1 - blend_start));
}
double LargestHarmless(const CalibrationPair& pair, double tolerance, double blend_start) {
  if (pair.guard >= 1) return kInfinity;
  if (pair.patches.empty() || std::isnan(pair.score))
    return LargestHarmless(pair.score, pair.error, pair.guard, tolerance, blend_start);
  double least = kInfinity;
  for (const PatchPair& patch : pair.patches) {
    const double guard = std::max(pair.guard, patch.guard);
    const double of_all = LargestHarmless(pair.blends_only ? pair.score : patch.score, patch.error, guard,
                                          tolerance, blend_start);
    least = std::min(least, of_all);
    if (!pair.blends_only || of_all == kInfinity || !(of_all > 0)) continue;
    // Where PatchScoreInBlend reaches the score that takes just enough, which is tau * pair.score / of_all
    const double own = std::max(patch.score, kLeastOwn * pair.score);
    least = std::min(least, pair.score + own * (1 - blend_start) * of_all / pair.score);
  }
  return std::max(least, pair.middle);
}
// Below which no point of the pose is accepted.
double AcceptedFrom(const CalibrationPair& pair) { return pair.patches.empty() ? pair.score : pair.middle; }

// What is known of the poses of one kind, sorted.
struct KindPoses {
  std::size_t poses = 0;
  double attainable = 0;       // of alpha
  std::vector<double> limits;  // a pose violates where tau exceeds its limit
  std::vector<double> scores;  // of poses without a guard, which are hits where tau_lo reaches them
  std::vector<double> partly;  // of poses with less than a full one, which are accepted below tau
  std::size_t Violations(double tau) const {
    return static_cast<std::size_t>(std::lower_bound(limits.begin(), limits.end(), tau) - limits.begin());
  }
  std::size_t Hits(double tau_lo) const {
    return static_cast<std::size_t>(std::upper_bound(scores.begin(), scores.end(), tau_lo) - scores.begin());
  }
  std::size_t Accepted(double tau) const {
    return static_cast<std::size_t>(std::lower_bound(partly.begin(), partly.end(), tau) - partly.begin());
  }
};

// The smallest rate that n poses without a violation promise.
double Attainable(double alpha, std::size_t n, double confidence) {
  return std::max(alpha, BinomialUpperBound(0, n, confidence));
}

// Most violations among n poses that promise a rate; the rate is attainable.
std::size_t Admitted(double rate, std::size_t n, double confidence) {
  std::size_t lo = 0, hi = n;  // lo is admitted
  while (lo < hi) {
    const std::size_t middle = lo + (hi - lo + 1) / 2;
    if (BinomialUpperBound(middle, n, confidence) <= rate * (1 + 1e-12)) {
      lo = middle;
    } else {
      hi = middle - 1;
    }
  }
  return lo;
}

bool FewAmong(std::size_t violations, std::size_t hits, double alpha, double confidence) {
  const double rate = std::min(1.0, kShareOfHits * alpha);
  return static_cast<double>(violations + 1) <= rate * static_cast<double>(hits + 1) &&
         BinomialUpperBound(violations, hits, confidence) <= rate * (1 + 1e-12);
}

// A pose within the ranges that no guard keeps from hitting.
struct ToldPose {
  double score = 0;
  bool wrong = false;  // by more than the tolerance
};
// The score above which most of them are wrong, whatever part of that tail is looked at; `largest` where
// there is none. Never falls with the tolerance: of the poses up to any score, those that become right are no
// fewer than of those up to a smaller one.
double MostlyRightUpTo(std::vector<ToldPose> poses, double largest) {
  std::ranges::stable_sort(poses, {}, &ToldPose::score);
  double up_to = 0;
  std::ptrdiff_t lead = 0, most = 0;  // of right ones over wrong ones
  for (const ToldPose& pose : poses) {
    lead += pose.wrong ? -1 : 1;
    if (lead >= most) most = lead, up_to = pose.score;
  }
  return poses.empty() || up_to == poses.back().score ? largest : up_to;
}

// How much farther than what was seen the score may go, where all that was seen is right: what scores speak of makes
// errors that grow no faster than its square (kpsa/calibration.h). Where there are none, nothing is known of that.
double ReachBeyond(double worst_error, double tolerance) {
  return worst_error > 0 ? std::clamp(std::sqrt(tolerance / worst_error), 1.0, kMostBeyondSeen) : 1;
}

// The largest tau that all demands allow, or 0.
double LargestAllowed(std::span<const CalibrationPair> pairs, double tolerance, const Calibration& wanted) {
  const double c = wanted.threshold.blend_start;
  std::map<int, KindPoses> kinds;
  std::vector<double> severe, candidates;
  std::vector<ToldPose> told;
  double largest_score = 0, worst_error = 0;
  bool by_patch = false;
  for (const CalibrationPair& pair : pairs) {
    KindPoses& kind = kinds[pair.kind];
    ++kind.poses;
    kind.limits.push_back(LargestHarmless(pair, tolerance, c));
    severe.push_back(LargestHarmless(pair, kSevere * tolerance, c));
    if (pair.guard == 0 && !std::isnan(pair.score)) kind.scores.push_back(pair.score);
    if (pair.guard < 1 && !std::isnan(pair.score)) kind.partly.push_back(AcceptedFrom(pair));
    by_patch = by_patch || (!pair.patches.empty() && !pair.blends_only);
    if (std::isfinite(pair.score)) largest_score = std::max(largest_score, pair.score);
    if (pair.guard < 1) worst_error = std::max(worst_error, std::isnan(pair.error) ? kInfinity : pair.error);
    if (pair.guard == 0 && std::isfinite(pair.score) && pair.kind != static_cast<int>(PoseKind::kBeyond))
      told.push_back({pair.score, !(pair.error <= tolerance)});
    for (const double limit : {kind.limits.back(), severe.back()}) {
      if (limit < kInfinity) candidates.push_back(limit);
    }
  }
  // Where patches miss by themselves, what scores high is exact where it would be wrong
  if (!by_patch) largest_score = MostlyRightUpTo(std::move(told), largest_score);
  largest_score *= ReachBeyond(worst_error, tolerance);
  const double cap = largest_score / c * (1 + 1e-12);
  for (double& candidate : candidates) candidate = std::min(candidate, cap);
  candidates.push_back(cap);
  std::sort(candidates.rbegin(), candidates.rend());
  candidates.erase(std::unique(candidates.begin(), candidates.end()), candidates.end());
  std::sort(severe.begin(), severe.end());
  std::map<int, std::size_t> admitted;
  for (auto& [number, kind] : kinds) {
    std::sort(kind.limits.begin(), kind.limits.end());
    std::sort(kind.scores.begin(), kind.scores.end());
    std::sort(kind.partly.begin(), kind.partly.end());
    kind.attainable = Attainable(wanted.alpha, kind.poses, wanted.confidence);
    admitted[number] = Admitted(kind.attainable, kind.poses, wanted.confidence);
  }
  const std::size_t severe_admitted = Admitted(wanted.attainable_severe, pairs.size(), wanted.confidence);
  for (const double tau : candidates) {
    if (!(tau > 0)) break;
    if (static_cast<std::size_t>(std::lower_bound(severe.begin(), severe.end(), tau) - severe.begin()) >
        severe_admitted)
      continue;
    std::size_t violations = 0, hits = 0;
    bool allowed = true;
    for (const auto& [number, kind] : kinds) {
      const std::size_t v = kind.Violations(tau), accepted = kind.Accepted(tau);
      allowed = allowed && v <= admitted[number] &&
                (v == 0 || FewAmong(v, accepted, kind.attainable, wanted.confidence));
      violations += v, hits += by_patch ? accepted : kind.Hits(tau * c);
    }
    if (allowed && FewAmong(violations, hits, wanted.attainable_alpha, wanted.confidence)) return tau;
  }
  return 0;
}

// What a threshold means on the poses; the margin forgives the rounding of the limit itself.
void Count(std::span<const CalibrationPair> pairs, double tolerance, Calibration* c) {
  std::map<int, Calibration::Kind> kinds;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const CalibrationPair& pair = pairs[i];
    Calibration::Kind& kind = kinds[pair.kind];
    kind.kind = pair.kind;
    const double weight = EmittedWeight(pair, c->threshold), error = EmittedError(pair, c->threshold);
    ++kind.poses;
    kind.hits += weight == 0;
    c->near_clips += pair.near_clips, c->hits_near_clips += pair.near_clips && weight == 0;
    kind.accepted += weight < 1;
    kind.violations += weight < 1 && !(error <= tolerance * (1 + 1e-9));
    c->severe += weight < 1 && !(error <= kSevere * tolerance * (1 + 1e-9));
    if (weight < 1 && (c->worst == Calibration::kNoPose || error > c->worst_error))
      c->worst = i, c->worst_error = error;
  }
  for (auto& [number, kind] : kinds) {
    kind.upper_bound = BinomialUpperBound(kind.violations, kind.poses, c->confidence);
    c->upper_bound = std::max(c->upper_bound, kind.upper_bound);
    c->hits += kind.hits, c->accepted += kind.accepted, c->violations += kind.violations;
    c->kinds.push_back(kind);
  }
  c->hit_rate = static_cast<double>(c->hits) / static_cast<double>(pairs.size());
  c->accepted_rate = static_cast<double>(c->accepted) / static_cast<double>(pairs.size());
}

}  // namespace

std::vector<PatchPair> OutstandingPatches(std::vector<PatchPair> patches) {
  std::sort(patches.begin(), patches.end(), [](const PatchPair& a, const PatchPair& b) {
    return std::tuple(a.score, -a.error, a.guard) < std::tuple(b.score, -b.error, b.guard);
  });
  std::vector<PatchPair> kept;
  for (const PatchPair& patch : patches) {
    const bool outdone = std::ranges::any_of(kept, [&](const PatchPair& other) {
      return other.error >= patch.error && other.guard <= patch.guard;
    });
    if (!outdone) kept.push_back(patch);
  }
  return kept;
}

double EmittedWeight(const CalibrationPair& pair, const SoftCacheThreshold& threshold) {
  double weight = std::isnan(pair.score) ? 1 : FullWeight(pair.score, threshold);
  if (!pair.patches.empty() && weight > 0 && !std::isnan(pair.score))
    weight = 0.5 * (weight + FullWeight(pair.middle, threshold));
  return threshold.tau == kInfinity ? weight : std::max(weight, std::isnan(pair.guard) ? 1 : pair.guard);
}

double EmittedError(const CalibrationPair& pair, const SoftCacheThreshold& threshold) {
  const double weight = EmittedWeight(pair, threshold);
  if (weight == 1) return 0;
  if (pair.patches.empty()) return (1 - weight) * pair.error;
  double error = 0;
  for (const PatchPair& patch : pair.patches) {
    const double score =
        pair.blends_only ? PatchScoreInBlend(patch.score, pair.score, threshold) : patch.score;
    error = std::max(error,
                     (1 - std::max({pair.guard, patch.guard, FullWeight(score, threshold)})) * patch.error);
  }
  return error;
}

Calibration Calibrate(std::span<const CalibrationPair> pairs, double tolerance, double alpha,
                      double blend_start, double confidence) {
  Calibration result;
  result.confidence = confidence;
  result.poses = pairs.size();
  result.alpha = alpha;
  result.threshold.blend_start = std::clamp(blend_start, 1e-3, 1.0);
  std::map<int, std::size_t> counts;
  for (const CalibrationPair& pair : pairs) ++counts[pair.kind];
  std::size_t fewest = pairs.size();
  for (const auto& [kind, count] : counts) fewest = std::min(fewest, count);
  result.attainable_alpha = Attainable(alpha, fewest, confidence);
  result.attainable_severe = Attainable(kSevereShare * alpha, pairs.size(), confidence);
  result.enough_poses = result.attainable_alpha <= alpha;
  if (!(tolerance > 0)) return result;  // never a hit: the exact rig
  if (tolerance == kInfinity) {
    result.threshold.tau = kInfinity;
    result.hit_rate = result.accepted_rate = 1;
    return result;
  }
  if (pairs.empty()) {
    result.warning = "there are no calibration poses, so nothing is ever a hit";
    return result;
  }
  if (!result.enough_poses) {
    result.warning = fmt::format(
        "{} calibration poses{} cannot promise a violation rate of {:g}; the threshold keeps {:.3g} ({})",
        fewest, counts.size() > 1 ? " of a kind" : "", alpha, result.attainable_alpha,
        alpha > 0 ? fmt::format("at least {:.0f} poses are needed",
                                std::ceil(std::log(1 - confidence) / std::log1p(-alpha)))
                  : "no number of poses can");
  }
  const double tau = LargestAllowed(pairs, tolerance, result);
  if (tau > 0) result.threshold.tau = tau;
  if (!(tau > 0)) result.warning = "no threshold keeps the violation rate, so nothing is ever a hit";
  Count(pairs, tolerance, &result);
  return result;
}

double ExpectedHitRate(const Calibration& calibration) {
  if (calibration.near_clips > 0)
    return static_cast<double>(calibration.hits_near_clips) / static_cast<double>(calibration.near_clips);
  if (calibration.kinds.empty()) return calibration.hit_rate;
  const Calibration::Kind& sampled = calibration.kinds.front();
  return static_cast<double>(sampled.hits) / static_cast<double>(std::max<std::size_t>(1, sampled.poses));
}

}  // namespace kpsa::engine
