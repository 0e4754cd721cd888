#include "kpsa/training/training_trials.h"

#include <algorithm>
#include <utility>

namespace kpsa::engine {

void TrainingTrials::Add(const char* what, double points, CalibratedSubspace tried, double weight) {
  // What clips lose counts, where that is more than what poses of all kinds do
  const double of_clips = tried.cost.lost_of_clips.value_or(0) - tried.cost.lost();
  const double ns = tried.cost.ns + points + std::max(of_clips, 0.0) * full_;
  tried_.push_back({what, tried.cues.cues.size(), static_cast<std::size_t>(tried.cues.rows()),
                    tried.cost.misses, ns / full_, false});
  const double weighed = weight * (tried.subspace.by_tile() ? ns / alike_ : ns);
  if (tried_.size() > 1 && weighed >= least_weighed_) return;
  best_ = std::move(tried), best_ns_ = ns, least_weighed_ = weighed, best_of_ = tried_.size() - 1;
}

CalibratedSubspace TrainingTrials::Take(std::vector<TrainingRecord::Tried> earlier) {
  tried_[best_of_].taken = true;
  std::erase_if(earlier, [&](TrainingRecord::Tried& one) {
    one.taken = false;
    return std::ranges::find(tried_, one.what, &TrainingRecord::Tried::what) != tried_.end();
  });
  best_.record.tried = std::move(earlier);
  best_.record.tried.insert(best_.record.tried.end(), tried_.begin(), tried_.end());
  return std::move(best_);
}

}  // namespace kpsa::engine
