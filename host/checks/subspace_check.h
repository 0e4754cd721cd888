// A fresh subspace tried on poses that it was not trained on: where it is worst, and what it costs. That is
// told by frames of clips, where there are any: poses move all controls at once, which no playback does.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "base/status.h"
#include "host/checks/playback_times.h"
#include "host/watch.h"
#include "kpsa/training/trainer.h"
#include "rig/build/rig_builder.h"

namespace kpsa::engine {

struct SubspaceCheck {
  struct Pose {
    std::string controls;     // and the clip: "wave at 0.53 s, jaw.rotateX -22, smile 0.9"
    std::string region;       // where its worst point is
    double max = 0, rms = 0;  // metres
  };
  struct Region {
    std::string name;  // the joint that moves its points most, or the mesh
    double rms = 0, max = 0;
  };
  std::size_t poses = 0, reconstructed = 0;  // all of them, unless something beyond guards prevents it
  std::vector<Pose> worst_poses;             // at most five, worst first
  std::vector<Region> worst_regions;         // at most five, by RMS
  double rms = 0, max = 0;                   // of the reconstruction without misses, metres
  std::size_t clip_frames = 0;               // that were timed; 0: the poses were
  double full_ms = 0, accelerated_ms = 0;    // of a frame, means, or of a pose, medians; accelerated: a hit
};

struct SubspaceCheckOptions {
  std::size_t poses = 60;
  std::uint64_t seed = 1;
  bool groups = true;    // DrawNewPoses
  PlaybackTimes played;  // no hits: the poses are timed
  Watch watch;           // of poses
};

// Evaluates new poses, drawn as the held-out ones of training are, fully and with every pose reconstructed:
// guards are lifted. The rig's graph is rewritten. A rig without controls and clips gives no poses. Errors: a
// full evaluation that fails or is not finite names its pose.
Result<SubspaceCheck> CheckSubspace(Rig* rig, const AccelerateEntry& entry,
                                    const std::shared_ptr<const Subspace>& subspace,
                                    const std::vector<TrainingClip>& clips,
                                    const SubspaceCheckOptions& options);

}  // namespace kpsa::engine
