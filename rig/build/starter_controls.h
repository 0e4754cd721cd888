// Inside of the starter rig's writer: what may move. Nothing outside rig/build includes this.
#pragma once

#include <string>
#include <vector>

#include "rig/build/point_motion.h"
#include "rig/build/starter_character.h"

namespace kpsa::engine {

struct StarterControls {
  std::string text;                   // `controls`, grouped by part of the body and side
  std::vector<ControlPlug> controls;  // that it declares
};
// What clips move, as far as they do; where they move nothing, guesses.
StarterControls WriteControls(const StarterCharacter& character);

}  // namespace kpsa::engine
