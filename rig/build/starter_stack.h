// Inside of the starter rig's writer: the character, its deformers and what may be tried with them. Nothing outside
// rig/build includes this.
#pragma once

#include <string>

#include "rig/build/starter_character.h"

namespace kpsa::engine {

struct StarterStack {
  std::string text;    // `character`, `nodes`, `deform` and what is suggested as overrides
  std::string mush;    // the name of the deltaMush that ends every stack
  std::string remark;  // a sentence on what the rig lacks; "" where nothing
};
// `file` is the character as the rig names it.
StarterStack WriteStack(const StarterCharacter& character, const std::string& file, int iterations);

}  // namespace kpsa::engine
