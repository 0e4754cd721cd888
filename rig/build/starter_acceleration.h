// Inside of the starter rig's writer: what kpsa train learns and kpsa bench measures. Nothing outside rig/build
// includes this.
#pragma once

#include <string>

#include "rig/build/starter_controls.h"
#include "rig/build/writer.h"

namespace kpsa::engine {

struct StarterAcceleration {
  std::string text;    // `clips` and `accelerate`; or a comment that says why there is nothing to accelerate
  std::string remark;  // a sentence on what the rig lacks; "" where nothing
  bool accelerates = false;
};
// `mush` ends every stack. Plays clips of *rig, which is `character`'s, and has none before and after. Errors: those
// of evaluating its controls.
Result<StarterAcceleration> WriteAcceleration(const StarterCharacter& character,
                                              const StarterControls& controls, const std::string& mush,
                                              const StarterOptions& options, Rig* rig);

}  // namespace kpsa::engine
