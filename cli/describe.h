// The program's commands and flags, as CLI11 knows them, as data for completions and the man page.
#pragma once

#include "cli/command.h"
#include "report/command_docs.h"

namespace kpsa::engine {

CommandDoc Describe(const CLI::App& command);

}  // namespace kpsa::engine
