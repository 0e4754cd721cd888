// Which transforms carry the accelerated points rigidly with their space, so that no guard need watch them.
// Being an ancestor of the space is not enough: points that weigh on joints off its chain,
// and deformers that act in the world's axes, see it move. Internal to training.
#pragma once

#include <string>
#include <vector>

#include "kpsa/training/trainer.h"

namespace kpsa::engine {

struct Carried {
  std::vector<std::string> rigid;  // names of transforms of the chain, from the space up
  // A uniform scale above the space scales the points in its frame, and nothing else.
  bool scales = false;
};

// Tried: at each of the poses (and some times of the clips) the transforms of the chain are turned and
// shifted at random; those carry the points that move none of them, in the space, by more than a hundredth of
// the tolerance and what rounding may do.
Result<Carried> FindCarried(const TrainingRig& rig, Compiler* compiler,
                            const std::vector<TrainingClip>& clips, const std::vector<SampledPose>& poses,
                            const Matrix4& inverse_rest_stretch, double diagonal, double tolerance);

}  // namespace kpsa::engine
