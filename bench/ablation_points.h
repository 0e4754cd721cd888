// What each choice of cues is worth at equal numbers of points: which are chosen (the paper's rule, Q-DEIM,
// A-optimal, random), where they lie (output points, an earlier stage, scalars besides), and how they are
// turned into points (least squares, maximum a posteriori).
#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "bench/ablation_poses.h"

namespace kpsa::engine::ablation {

struct PointsScore {
  double rms = 0, max = 0;  // of the test clip, % of the diagonal
  double cue_us = 0;        // a frame, for the cues alone
  bool fell_back = false;   // least squares that are too badly conditioned: maximum a posteriori instead
};
struct PointsRow {
  std::string cues;
  const char* estimator = "";
  std::vector<PointsScore> scores;  // by count
};

// Row after row, as they are there.
void ComparePoints(AblationPoses* poses, std::span<const std::size_t> counts,
                   const std::function<void(const PointsRow&)>& done);

std::string PointsHeader(std::span<const std::size_t> counts);
std::string PointsText(const PointsRow& row);

}  // namespace kpsa::engine::ablation
