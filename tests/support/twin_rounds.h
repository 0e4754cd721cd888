// The engine against the naive twin: plans of a random graph, evaluated in every way that there is, with random
// edits between plans and random values between evaluations.
//
//   values     outputs, bit for bit: pulled one by one or all together, serial, parallel, in a workspace that
//              another evaluator uses, after Invalidate, and as frames in blocks on threads
//   laziness   what ran was needed by what was pulled, as the twin goes through the graph
//   dirtiness  what ran had a plug behind it that was set to another value since it last ran
//   failures   which evaluations fail, and at which node
#pragma once

#include <map>
#include <string>

#include "graph/node_registry.h"
#include "tests/support/choices.h"

namespace kpsa::engine {

// What the graphs were to contain.
struct TwinCounts {
  int plans = 0, refused = 0;  // by the compiler, since a constant node fails
  int steps = 0, unit_steps = 0, segments = 0, shared_segments = 0, gathers = 0, passed_by = 0;
  int evaluations = 0, failures = 0, lazy_runs = 0, invalidated = 0;
  int frames = 0, failed_frames = 0;
};

// What a test does wrong on purpose, to see it noticed.
struct TwinMistakes {
  std::map<std::string, std::string> disguises;  // see RandomGraph
  bool forgets_to_set = false;                   // some values do not reach the evaluators
  bool invalidates = false;                      // evaluators forget what they know, and nobody is told
  double* hidden = nullptr;  // what the node "peek" reads and does not declare: it changes
};

struct TwinSizes {
  int nodes = 30, editions = 2, rounds = 5, edits = 12;
};

// The first disagreement, or "".
std::string Disagreement(const NodeRegistry& registry, Choices choices, const TwinSizes& sizes,
                         TwinCounts* counts, const TwinMistakes& mistakes = {});

}  // namespace kpsa::engine
