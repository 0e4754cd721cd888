#include "kpsa/activity.h"

namespace kpsa::engine {

double Activity(std::span<const TrainedRange> ranges, std::span<const std::size_t> entries_of,
                std::span<const float> entries) {
  double sum = 0;
  std::size_t e = 0;
  for (const std::size_t count : entries_of) {
    double most = 0;
    for (const std::size_t end = e + count; e < end; ++e)
      most = std::max(most, ActivityOf(entries[e], ranges[e].rest, ranges[e].per_reach()));
    sum += most;
  }
  return sum;
}

}  // namespace kpsa::engine
