// A fresh subspace tried on poses that it was not trained on: what it costs, and where it is worst.
#pragma once

#include <string>
#include <vector>

#include "cli/acceleration.h"

namespace kpsa {

struct SubspaceCheck {
  struct Pose {
    std::string controls;     // the three farthest from rest: "jaw.rotateX -22, smile 0.9"
    std::string region;       // where its worst point is
    double max = 0, rms = 0;  // metres
  };
  struct Region {
    std::string name;  // the joint that moves its points most, or the mesh
    double rms = 0, max = 0;
  };
  std::size_t poses = 0;
  std::vector<Pose> worst_poses;           // at most five, worst first
  std::vector<Region> worst_regions;       // at most five, by RMS
  double rms = 0, max = 0;                 // of the reconstruction without misses, metres
  double full_ms = 0, accelerated_ms = 0;  // of a pose, medians; accelerated: a hit
  // With that share of misses, each of which costs both.
  double PredictedSpeedup(double hit_rate) const;
};

// Evaluates sampled poses of the rig's controls at rest, fully and with every pose reconstructed. The rig's
// graph is rewritten. A rig without controls gives no poses.
Result<SubspaceCheck> CheckSubspace(Rig* rig, const Acceleration& entry,
                                    std::shared_ptr<const Subspace> subspace, std::size_t poses,
                                    std::uint64_t seed);

}  // namespace kpsa
