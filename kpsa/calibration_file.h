// The calibration poses in the .kpsa file, and the patches that these speak of. Internal to
// kpsa/subspace_file.
#pragma once

#include "base/digest.h"
#include "files/safetensors.h"
#include "kpsa/subspace.h"

namespace kpsa::engine {

bool AnyNearClips(const Subspace& s);  // CalibrationPair::near_clips
// Errors: tensors that are missing, of another size or type, or that cannot be true. Tiles, and how many of
// them a patch has, have been read.
Status ReadCalibration(const SafetensorsFile& file, Subspace* s);
void AddCalibration(const Subspace& s, SafetensorsWriter* writer);
void HashCalibration(const Subspace& s, Hasher* hasher);

}  // namespace kpsa::engine
