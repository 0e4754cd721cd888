// What quaternion keys do between frames: a joint that is keyed about two axes turns a little about the
// third, which no control and no frame shows. And what rotations do that are composed in another order: half
// the product of two angles is one about the third axis, of which the frames of other clips may show hardly
// any. A shift goes on top of a clip in what the clip has turned: a joint that is shifted along one axis moves along the
// others there. Internal to training.
#pragma once

#include "kpsa/training/trainer.h"

namespace kpsa::engine {

// The rig with more controls behind its own: the free rotate axes of transforms that have controls about two
// of their axes only, in a small range about rest; and likewise the free translate axes of those that turn, too.
TrainingRig WithTilts(const TrainingRig& rig);
// Gives poses of the first `drawn` controls values for the others: at rest in half of the poses, else within
// their ranges; and turns those that have a tilt in half of the poses.
void AddTilts(const std::vector<ControlRange>& controls, std::size_t drawn, std::uint64_t seed,
              std::vector<SampledPose>* poses);

}  // namespace kpsa::engine
