// What people want to know of a plan: who reads whom, what a segment is for, where time went.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "graph/plan.h"
#include "graph/profile.h"

namespace kpsa::engine {

// Steps that a step reads, those of its lazy inputs included; ascending, each once.
std::vector<Index> Producers(const Plan& plan, Index step);
// "always", or "only if body_kpsa asks for it" for lazy segments.
std::string SegmentName(const Plan& plan, Index segment);
// Who needs a step: up to three nodes that read it, or "the request".
std::string NeededBy(const Plan& plan, Index step);
// "mush", or "mush (gather)" for a helper step.
std::string StepName(const Plan& plan, Index step);

// A node's share of an evaluation, its steps of one segment taken together.
struct NodeTime {
  std::string name, type, segment;
  std::vector<Index> steps;
  std::uint64_t count = 0;               // computes, all frames
  Index points = 0, points_total = 0;    // of its largest step
  double self_ns = 0, inclusive_ns = 0;  // all frames; inclusive: with all that is upstream, each step once
};
// In descending order of self time.
std::vector<NodeTime> NodeTimes(const Plan& plan, const Profile& profile);

// The chain of steps, each reading the one before, that takes longest; a lower bound on parallel evaluation.
struct CriticalPath {
  std::vector<Index> steps;
  double ns = 0;  // all frames
};
CriticalPath FindCriticalPath(const Plan& plan, const Profile& profile);

}  // namespace kpsa::engine
