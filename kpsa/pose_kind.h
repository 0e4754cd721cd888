// Kinds of held-out poses, as a subspace remembers them of its calibration.
#pragma once

#include <cstdint>

namespace kpsa::engine {

// Ways of drawing poses. Violations are promised of each kind by itself, so that a pose which no clip has is
// no excuse (kpsa/calibration.h).
enum class PoseKind : std::uint8_t {
  kSampled,     // SamplePoses (kpsa/training/poses.h)
  kMixture,     // 3 to 6 controls anywhere in their ranges, the others at rest
  kNeighbours,  // 2 to 6 controls that move the same points, at 50 to 100 % of their reach
  kBeyond,      // a sampled pose with 1 to 3 controls up to kBeyondShare of their range, and their margins,
                // beyond an end
  kHeld,  // a moment of a clip, with controls that no clip moves anywhere in their ranges: what an animator
          // sets over playback, each by itself far out in every second pose
};
inline constexpr int kPoseKinds = 5;
inline constexpr double kBeyondShare = 0.1;
const char* PoseKindName(PoseKind kind);  // "sampled", "mixtures", ...

}  // namespace kpsa::engine
