#include "bench/program.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "cli/interrupt.h"

namespace kpsa::engine {

Result<ProgramCost> RunProgram(std::vector<std::string> arguments, const std::string& output) {
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, output.c_str(), O_WRONLY | O_CREAT | O_TRUNC,
                                   0644);
  pid_t child = 0;
  const int error = posix_spawn(&child, argv[0], &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) return Status::Invalid("cannot be started: {}", std::strerror(error)).At({arguments[0]});
  int ended = 0;
  rusage used = {};
  while (wait4(child, &ended, 0, &used) < 0) {
    if (errno != EINTR) return Status::Invalid("cannot be waited for").At({arguments[0]});
  }
  if (Interrupted()) return InterruptedStatus();
  if (!WIFEXITED(ended) || WEXITSTATUS(ended) != 0)
    return Status::Invalid("{} failed", fmt::join(arguments, " "));
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return ProgramCost{seconds(used.ru_utime) + seconds(used.ru_stime),
                     static_cast<std::size_t>(used.ru_maxrss) * 1024};
}

}  // namespace kpsa::engine
