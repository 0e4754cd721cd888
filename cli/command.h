// What a subcommand is: a function that declares its options on the program, and the work that runs
// afterwards.
#pragma once

#include <functional>

#include "base/status.h"

namespace CLI {
class App;
}

namespace kpsa::engine {

// The exit code (0, or 1 where a check failed, things differ or training would not pay), or errors; see
// ExitCode in cli/common.h.
using CommandResult = Result<int>;
using Command = std::function<CommandResult()>;

// Each adds one subcommand to the program. When it is chosen, *chosen becomes its work.
void AddInitCommand(CLI::App* program, Command* chosen);
void AddValidateCommand(CLI::App* program, Command* chosen);
void AddInspectCommand(CLI::App* program, Command* chosen);
void AddFmtCommand(CLI::App* program, Command* chosen);
void AddEvalCommand(CLI::App* program, Command* chosen);
void AddGetCommand(CLI::App* program, Command* chosen);
void AddPoseCommand(CLI::App* program, Command* chosen);
void AddRenderCommand(CLI::App* program, Command* chosen);
void AddTrainCommand(CLI::App* program, Command* chosen);
void AddLearnCommand(CLI::App* program, Command* chosen);
void AddBenchCommand(CLI::App* program, Command* chosen);
void AddReportCommand(CLI::App* program, Command* chosen);
void AddViewCommand(CLI::App* program, Command* chosen);
void AddCompileCommand(CLI::App* program, Command* chosen);
void AddProfileCommand(CLI::App* program, Command* chosen);
void AddExplainCommand(CLI::App* program, Command* chosen);
void AddCompareCommand(CLI::App* program, Command* chosen);
void AddGraphCommand(CLI::App* program, Command* chosen);
void AddNodesCommand(CLI::App* program, Command* chosen);
void AddWeightsCommand(CLI::App* program, Command* chosen);
void AddCompletionsCommand(CLI::App* program, Command* chosen);
void AddManCommand(CLI::App* program, Command* chosen);
void AddHelpCommand(CLI::App* program, Command* chosen);

}  // namespace kpsa::engine
