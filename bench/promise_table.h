// What tried poses say about the promise: figures by rig, tolerance, seed and kind of pose, and their tables.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "bench/promise_poses.h"

namespace kpsa::engine {

// What was trained.
struct PromiseCase {
  std::string rig;
  double scale = 1, tolerance = 0;  // of the rig's tolerance; metres
  std::uint64_t seed = 0;
  double promised = 0;  // share of poses that may be farther than the tolerance
};

// One kind of pose. A violation is a pose that is accepted, a hit or a blend, although a point is farther
// than the tolerance from where the full evaluation has it.
struct PromiseRow {
  PromiseCase of;
  TrialKind kind = TrialKind::kSampler;
  std::size_t poses = 0, hits = 0, blends = 0, misses = 0;
  std::size_t violations = 0, hit_violations = 0;
  std::size_t far = 0;  // accepted, and farther than three tolerances
  double worst = 0;     // of an accepted pose, in tolerances

  // Whether chance does not explain it: the 95 % lower bound of the violations is above the promised rate, or
  // that of violations among hits above twice it.
  bool broken() const;
};
PromiseRow CountOutcomes(const PromiseCase& of, TrialKind kind, std::span<const PromiseOutcome> outcomes);

// Walks of one training.
struct WalkRow {
  PromiseCase of;
  std::size_t walks = 0, accepted = 0;  // of these, with a step that was accepted
  double jump = 0;                      // the largest, in tolerances
  std::string control;                  // whose; empty where nothing jumped
};

std::string PromiseText(std::span<const PromiseRow> rows, std::span<const WalkRow> walks);
// A table of rigs and tolerances, all seeds together, and then all rows.
std::string PromiseMarkdown(std::span<const PromiseRow> rows, std::span<const WalkRow> walks);

}  // namespace kpsa::engine
