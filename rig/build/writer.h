// The starter rig of `kpsa init`: a rig file for a character that loads, trains and benches as it is, with
// comments that say what to change.
#pragma once

#include <optional>
#include <string>

#include "base/status.h"
#include "graph/node_registry.h"

namespace kpsa::engine {

struct StarterOptions {
  std::string character;       // the path as the rig is to name it, relative to the rig; "": the file's name
  std::string subspace;        // likewise; "": the character's name with .kpsa
  int iterations = 10;         // of the deltaMush that is put after the file's own deformers
  std::optional<int> samples;  // training poses drawn from the controls; unset: by their number
};

// The text of the rig. Controls: every local rotation (degrees, in the rest pose's axes) and translation that
// a clip moves away from rest, every expression of VRM that moves a morph target, and every other morph
// weight, ranged by all clips, between their keys too, and rounded outwards; joints that carry no point are
// left out. They are grouped by part of the body and side. Where no clip moves anything: guesses, marked so.
// Accelerated: the end of every mesh's stack, in the space of the deepest transform that carries 90 % of the
// skin; clips, tolerance and samples are those of rig/build/starter_training.h. In comments, as lines that work: IK
// of arms and legs, a cage about the jaw, dual quaternions. Errors: those of reading the character. *remark:
// a sentence on what the rig lacks, an accelerate entry or clips for it; "" where nothing.
Result<std::string> StarterRig(const NodeRegistry& registry, const std::string& character_path,
                               const StarterOptions& options = {}, std::string* remark = nullptr);

}  // namespace kpsa::engine
