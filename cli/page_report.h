// A rig as a page: what kpsa report RIG -o FILE.html gathers, measures and writes.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/acceleration.h"
#include "cli/command.h"
#include "cli/common.h"

namespace kpsa::engine {

struct PageFlags : Flags {
  AccelerationFlags acceleration;
  std::vector<std::string> clips;
  std::optional<std::string> runs;
};

// Whether a file is a rig or a character, which make a page.
bool MakesPage(const std::string& file);
CommandResult WritePage(const PageFlags& flags);

}  // namespace kpsa::engine
