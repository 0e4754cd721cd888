// Between rig files and the trainer: what an `accelerate:` entry of a rig means in plugs.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "kpsa/training/trainer.h"
#include "rig/build/rig_builder.h"

namespace kpsa::engine {

// The stages of each accelerated mesh up to the accelerated one, the space, and all that may vary.
AccelerationTarget MakeTarget(const Rig& rig, const AccelerateEntry& entry);
// Refers to the rig, which must outlive it.
TrainingRig MakeTrainingRig(Rig* rig, const AccelerateEntry& entry);
// What the entry asks for; the rest is the trainer's own. Where it says nothing of samples, as many as kpsa init would write
// for all that training poses (of light, which takes seconds a pose, none).
TrainOptions TrainOptionsOf(const Rig& rig, const AccelerateEntry& entry);
// Every frame of the clips, as ClipTimes counts them (host/rig_frames.h). Errors: a clip that the character lacks.
Result<std::vector<TrainingClip>> ClipFrames(const Rig& rig, const std::vector<std::string>& clips);
// Of all entries of the rig, each once.
std::vector<std::string> TestClips(const Rig& rig);
// The entry of the rig's accelerate section, by name where there are several. Errors: none, not that one,
// or one of a reference, which is trained there.
Result<AccelerateEntry> ChooseEntry(const Rig& rig, const std::optional<std::string>& name);
// What may vary when a clip plays: time, and the controls that the clip does not drive.
std::vector<PlugRef> VaryingPlugs(const Rig& rig);

}  // namespace kpsa::engine
