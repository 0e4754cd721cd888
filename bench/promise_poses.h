// The poses that the promise is tried on. They depend on the rig and the seed alone.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "bench/promise_rig.h"

namespace kpsa::engine {

enum class TrialKind : std::uint8_t {
  kSampler,   // as the trainer draws them: what the promise is about
  kMixtures,  // 3 to 6 controls anywhere in their ranges, the others at rest
  kMargin,    // the trainer's, 1 to 3 controls 0 to 10 % of their range beyond an end
  kClips,     // the clips, trained and test, between their frames
};
inline constexpr std::array kTrialKinds{TrialKind::kSampler, TrialKind::kMixtures, TrialKind::kMargin,
                                        TrialKind::kClips};
const char* TrialKindName(TrialKind kind);

// None where the rig has no controls, or no clips, for that kind.
Result<std::vector<PromisePose>> DrawPoses(PromiseRig* rig, TrialKind kind, std::size_t count,
                                           std::uint64_t seed);

// Controls from 5 % of their range within an end to 20 % beyond, over sampled poses: all of at most `most`
// controls, else `most` evenly chosen ones. Other seeds take the other end and other controls.
Result<std::vector<PromiseWalk>> DrawWalks(PromiseRig* rig, std::size_t most, std::uint64_t seed);

}  // namespace kpsa::engine
