// The compiler's second pass: steps with their segments and point sets, before they are ordered and laid out.
// Internal to graph/.
#pragma once

#include <vector>

#include "graph/node_binding.h"

namespace kpsa::engine {

// Where a draft step reads an input.
struct DraftInput {
  enum class Kind : std::uint8_t { kConstant, kVarying, kStep };
  Kind kind = Kind::kConstant;
  std::int8_t component = -1;
  bool lazy = false;
  Type type = Type::kDouble;
  const Value* value = nullptr;  // kConstant
  Index varying = kNoIndex;      // kVarying
  Index step = kNoIndex;         // kStep: a draft step
  int output = 0, element = 0;
  PointSet points;  // what is read, of a points input
};

struct DraftStep {
  Index instance = kNoIndex;  // kNoIndex: a gather
  Index segment = 0;
  InstanceSets sets;  // a gather has one output and one input
  std::vector<DraftInput> inputs;
  std::vector<Index> lazy_segments;     // by lazy input, in order; kNoIndex where nothing has to be evaluated
  std::vector<std::uint8_t> lazy_bits;  // by lazy input: its bit in what decide returns
  Type gather_type = Type::kPoints;
};

// What a lazy input needs alone; or what several of them share and nobody else reads (`users`), which runs when the
// first of them is chosen. Those that are needed come after those that need them.
struct DraftSegment {
  Index parent = kNoIndex;  // which has run before
  Index owner =
      kNoIndex;    // the draft step of the lazy input, in the parent; where shared: if it is one of all users
  int depth = 0;   // below segment 0
  int owners = 0;  // that have to decide before it runs
  std::vector<Index> users;  // of what is shared: the segments that read it, shared ones among them
  std::vector<Index> needs;  // the shared segments that it reads
};

struct PlanDraft {
  std::vector<DraftStep> steps;
  std::vector<DraftSegment> segments;
  std::vector<DraftInput> outputs;  // by request output
  std::vector<bool> varying;        // by instance
  // Why readers of an instance read its input instead: ComputeGroup::passed_input; touches, strength_input
  enum class Passed : std::uint8_t { kNo, kEquals, kTouchesNone };
  std::vector<Passed> passed;  // by instance
};

// Decides segments and point sets backward from the request, and connects steps; inserts gathers where a
// reader wants other points than the buffer holds.
Result<PlanDraft> DraftPlan(InstanceTable& table, class StaticEvaluator& statics,
                            const std::vector<Source>& wanted, const Request& request);

}  // namespace kpsa::engine
