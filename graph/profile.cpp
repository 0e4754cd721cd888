#include "graph/profile.h"

#include <algorithm>
#include <chrono>
#include <mutex>

namespace kpsa::engine {
namespace {
std::mutex add_mutex;  // recording may come from several threads
}

void Profile::Add(const ProfileEvent& event) {
  std::lock_guard<std::mutex> lock(add_mutex);
  ++counts_[event.step];
  self_ns_[event.step] += event.end_ns - event.begin_ns;
  last_cause_[event.step] = event.cause;
  if (keep_events && events_.size() < max_events) events_.push_back(event);
}

void Profile::AddPart(Index step, int part, std::uint64_t ns) {
  if (part < 0 || part >= ComputeHost::kMaxParts) return;  // plugins name parts, too
  std::lock_guard<std::mutex> lock(add_mutex);
  part_ns_[step][static_cast<std::size_t>(part)] += ns;
}

void Profile::Clear() {
  std::fill(counts_.begin(), counts_.end(), 0);
  std::fill(self_ns_.begin(), self_ns_.end(), 0);
  std::fill(part_ns_.begin(), part_ns_.end(), PartTimes{});
  std::fill(last_cause_.begin(), last_cause_.end(), kNoIndex);
  events_.clear();
}

std::uint64_t ProfileClock() {
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  return static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(now).count());
}

std::string CauseName(const Plan& plan, Index cause) {
  if (cause == kNoIndex) return "first evaluation";
  const auto steps = static_cast<Index>(plan.steps().size());
  return cause < steps ? plan.step_name(cause) : plan.varying()[cause - steps].name;
}

}  // namespace kpsa::engine
