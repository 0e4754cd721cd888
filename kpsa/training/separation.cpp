#include "kpsa/training/separation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace kpsa::engine {

double AreaUnderRoc(std::span<const ScoredPose> poses) {
  std::vector<ScoredPose> sorted(poses.begin(), poses.end());
  for (ScoredPose& pose : sorted)
    if (std::isnan(pose.score)) pose.score = std::numeric_limits<double>::infinity();  // is never accepted
  std::ranges::sort(sorted, {}, &ScoredPose::score);
  double within = 0, beyond = 0, ordered = 0;
  for (std::size_t first = 0; first < sorted.size();) {
    std::size_t end = first;
    double within_here = 0, beyond_here = 0;
    for (; end < sorted.size() && sorted[end].score == sorted[first].score; ++end)
      ++(sorted[end].beyond ? beyond_here : within_here);
    ordered += beyond_here * (within + within_here / 2);
    within += within_here, beyond += beyond_here;
    first = end;
  }
  return ordered / (within * beyond);
}

TrainingRecord::Separation SeparationOf(std::span<const ScoreJudge> judges, double tolerance) {
  TrainingRecord::Separation result;
  std::vector<ScoredPose> measured, doubts;
  for (const ScoreJudge& judge : judges) {
    const bool beyond = !(judge.pose.error <= tolerance);
    result.beyond += beyond;
    measured.push_back({judge.pose.measured, beyond});
    doubts.push_back({judge.pose.doubt, beyond});
  }
  result.poses = judges.size();
  result.likeness = AreaUnderRoc(measured);
  result.doubts = AreaUnderRoc(doubts);
  return result;
}

}  // namespace kpsa::engine
