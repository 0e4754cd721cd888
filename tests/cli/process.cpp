#include "tests/cli/process.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <thread>

#include "tests/support/temporary_folder.h"

extern char** environ;

namespace kpsa::engine {
namespace {

using Clock = std::chrono::steady_clock;

// Sent once, after so many seconds (never where they are negative), and not before there is a file in `where`.
struct Interrupt {
  double seconds = -1;
  int signal = SIGINT;
  std::string where = {};

  bool IsDue(double now) const {
    if (seconds < 0 || now <= seconds) return false;
    return where.empty() ||
           std::filesystem::directory_iterator(where) != std::filesystem::directory_iterator();
  }
};

// The processor time of a process that runs.
double SecondsOf(pid_t process) {
  clockid_t clock;
  struct timespec time = {};
  if (::clock_getcpuclockid(process, &clock) != 0 || ::clock_gettime(clock, &time) != 0) return 0;
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

ProcessResult Run(std::vector<std::string> words, double limit_seconds, const Interrupt& interrupt,
                  const std::string& folder, const std::vector<std::string>& more_environment) {
  ProcessResult result;
  const TemporaryFolder streams;
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, 1, (streams / "out").c_str(), O_WRONLY | O_CREAT, 0600);
  posix_spawn_file_actions_addopen(&actions, 2, (streams / "err").c_str(), O_WRONLY | O_CREAT, 0600);
  if (!folder.empty()) posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());
  std::vector<char*> argv, environment;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  std::vector<std::string> entries = more_environment;
  for (std::string& entry : entries) environment.push_back(entry.data());
  for (char** entry = environ; *entry != nullptr; ++entry) environment.push_back(*entry);
  environment.push_back(nullptr);
  pid_t process = 0;
  const int spawned =
      posix_spawn(&process, words.front().c_str(), &actions, nullptr, argv.data(), environment.data());
  posix_spawn_file_actions_destroy(&actions);
  if (spawned != 0) {
    result.err = "cannot be started";
    return result;
  }
  const auto begin = Clock::now();
#if defined(KPSA_WITH_ASAN) || defined(KPSA_WITH_TSAN)
  limit_seconds *= 10;  // it is there to end what hangs
#endif
  // Of the process's own time: what else runs does not count, but for what waits for ever
  const double longest = 20 * limit_seconds;
  bool interrupted = false, ended = false;
  int status = 0;
  struct rusage usage = {};
  while (::wait4(process, &status, WNOHANG, &usage) == 0) {
    const double seconds = std::chrono::duration<double>(Clock::now() - begin).count();
    if (!interrupted && interrupt.IsDue(seconds)) {
      ::kill(process, interrupt.signal);
      interrupted = true;
    }
    if ((SecondsOf(process) > limit_seconds || seconds > longest) && !ended) {
      ::kill(process, SIGKILL);
      ended = true;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  if (!ended) result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  result.peak_bytes = 1024 * static_cast<std::uint64_t>(usage.ru_maxrss);
  result.out = TemporaryFolder::Read(streams / "out");
  result.err = TemporaryFolder::Read(streams / "err");
  return result;
}

std::vector<std::string> Kpsa(const std::vector<std::string>& arguments) {
  std::vector<std::string> words = {KPSA_PROGRAM};
  words.insert(words.end(), arguments.begin(), arguments.end());
  return words;
}

}  // namespace

std::size_t ProcessResult::error_lines() const {
  return static_cast<std::size_t>(std::count(err.begin(), err.end(), '\n'));
}

ProcessResult RunKpsa(const std::vector<std::string>& arguments, double limit_seconds,
                      const std::string& folder, const std::vector<std::string>& environment) {
  return Run(Kpsa(arguments), limit_seconds, {}, folder, environment);
}

ProcessResult RunShell(const std::string& line, double limit_seconds, const std::string& folder) {
  return Run({"/bin/sh", "-c", line}, limit_seconds, {}, folder, {});
}

ProcessResult RunKpsaInterrupted(const std::vector<std::string>& arguments, double delay_seconds, int signal,
                                 const std::string& where) {
  return Run(Kpsa(arguments), 60, {delay_seconds, signal, where}, "", {});
}

}  // namespace kpsa::engine
