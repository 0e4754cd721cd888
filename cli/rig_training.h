// Between rig files and the trainer: what an `accelerate:` entry of a rig means in plugs.
#pragma once

#include <string>
#include <vector>

#include "io/rig_builder.h"
#include "kpsa/trainer.h"

namespace kpsa {

// The stages of each accelerated mesh up to the accelerated one, the space, and all that may vary.
AccelerationTarget MakeTarget(const Rig& rig, const Acceleration& acceleration);
// Refers to the rig, which must outlive it.
TrainingRig MakeTrainingRig(Rig* rig, const Acceleration& acceleration);
// Every frame of the clips at the rig's rate. Errors: a clip that the character lacks.
Result<std::vector<TrainingClip>> ClipFrames(const Rig& rig, const std::vector<std::string>& clips);
// What may vary when a clip plays: time, and the controls that the clip does not drive.
std::vector<PlugRef> VaryingPlugs(const Rig& rig);

}  // namespace kpsa
