#include "host/bench/promise.h"

#include <algorithm>
#include <cmath>

#include "kpsa/kpsa_node.h"

namespace kpsa::engine {
namespace {

double Share(std::size_t part, std::size_t all) {
  return all == 0 ? 0 : static_cast<double>(part) / static_cast<double>(all);
}

}  // namespace

void Promise::Make(const std::vector<AppliedSubspace>& applied) {
  tolerance = rate = 0;
  for (const AppliedSubspace& one : applied) {
    light = one.subspace->of_light();
    tolerance = std::max(tolerance, one.tolerance);
    rate = std::min(1.0, rate + CalibrationInForce(one).attainable_alpha);
  }
}

void Promise::Add(const std::string& clip, std::int64_t frame, bool hit, bool accepted, double error) {
  ++frames;
  hits += hit;
  if (!accepted) return;
  const bool is_beyond = !(error <= tolerance);
  beyond += is_beyond;
  hits_beyond += is_beyond && hit;
  if (worst_clip.empty() || error > worst_error) worst_clip = clip, worst_frame = frame, worst_error = error;
}

bool Promise::promised() const { return tolerance < kAnyError; }

bool Promise::kept() const {
  return !promised() || (beyond_share() <= rate && hits_beyond_share() <= hit_rate());
}

double Promise::beyond_share() const { return Share(beyond, frames); }
double Promise::hits_beyond_share() const { return Share(hits_beyond, hits); }

}  // namespace kpsa::engine
