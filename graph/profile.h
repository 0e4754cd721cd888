// What each step did and why, in an evaluator that was asked to record.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "base/types.h"
#include "graph/compute_context.h"
#include "graph/plan.h"

namespace kpsa::engine {

// One evaluation of a step.
struct ProfileEvent {
  Index step = 0;
  Index cause = kNoIndex;  // the producer that changed: a step, or steps().size() + varying; kNoIndex: none,
                           // it never ran
  std::uint64_t begin_ns = 0, end_ns = 0;
  int thread = 0;
  int frame = 0;  // as told to Evaluator::Record
};

class Profile {
 public:
  explicit Profile(const Plan& plan)
      : counts_(plan.steps().size(), 0),
        self_ns_(plan.steps().size(), 0),
        part_ns_(plan.steps().size()),
        last_cause_(plan.steps().size(), kNoIndex) {}
  const std::vector<std::uint64_t>& counts() const { return counts_; }    // by step
  const std::vector<std::uint64_t>& self_ns() const { return self_ns_; }  // by step
  const std::vector<Index>& last_cause() const { return last_cause_; }    // by step
  // By step: what its node says of parts of its work (ComputeHost::AddPart). Those of compute are within
  // self_ns, those of decide are not.
  using PartTimes = std::array<std::uint64_t, ComputeHost::kMaxParts>;
  const std::vector<PartTimes>& part_ns() const { return part_ns_; }
  const std::vector<ProfileEvent>& events() const { return events_; }
  bool keep_events = false;          // for traces; counts and times are kept always
  std::size_t max_events = 1000000;  // no more are kept beyond

  void Add(const ProfileEvent& event);                   // from any thread
  void AddPart(Index step, int part, std::uint64_t ns);  // likewise; a part that there is not is ignored
  void Clear();

 private:
  std::vector<std::uint64_t> counts_, self_ns_;
  std::vector<PartTimes> part_ns_;
  std::vector<Index> last_cause_;
  std::vector<ProfileEvent> events_;
};

std::uint64_t ProfileClock();  // nanoseconds of a steady clock

// "skin_1.envelope" or "node "jaw"" for the cause of an event.
std::string CauseName(const Plan& plan, Index cause);

}  // namespace kpsa::engine
