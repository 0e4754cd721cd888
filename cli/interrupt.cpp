#include "cli/interrupt.h"

#include <sys/time.h>
#include <unistd.h>

#include <csignal>
#include <string_view>

#include "files/temporaries.h"

namespace kpsa::engine {
namespace {

std::atomic<bool> interrupted{false};
std::atomic<int> scopes{0};

// Handlers call nothing but what is async-signal-safe (signal-safety(7)).
void Write(std::string_view text) {
  [[maybe_unused]] const ssize_t written = ::write(STDERR_FILENO, text.data(), text.size());
}

void End(int) {
  RemoveTemporaries();
  Write(scopes.load() == 0 ? "\nkpsa: interrupted\n" : "\nkpsa: interrupted; nothing was written\n");
  ::_exit(130);
}

void OnInterrupt(int) {
  if (scopes.load() == 0 || interrupted.exchange(true)) End(0);
  Write("\nkpsa: interrupted, ending; once more ends at once\n");
  itimerval grace = {};
  grace.it_value.tv_usec = 1000 * kGraceMs;
  ::setitimer(ITIMER_REAL, &grace, nullptr);
}

void RemoveAndPass(int signal) {
  RemoveTemporaries();
  ::signal(signal, SIG_DFL);
  ::raise(signal);
}

}  // namespace

void InstallSignalHandlers() {
  const auto handle = [](int signal, void (*handler)(int)) {
    struct sigaction action = {};
    action.sa_handler = handler;
    action.sa_flags = SA_RESTART;
    ::sigaction(signal, &action, nullptr);
  };
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    // Who starts a program with `nohup`, or in the background of a script, has it ignore them
    struct sigaction before = {};
    if (::sigaction(signal, nullptr, &before) == 0 && before.sa_handler == SIG_IGN) continue;
    handle(signal, OnInterrupt);
  }
  handle(SIGALRM, End);
  for (const int signal : {SIGPIPE, SIGQUIT, SIGABRT}) handle(signal, RemoveAndPass);
  handle(SIGXFSZ, SIG_IGN);
}

InterruptScope::InterruptScope() { ++scopes; }
InterruptScope::~InterruptScope() { --scopes; }

bool Interrupted() { return interrupted.load(std::memory_order_relaxed); }
const std::atomic<bool>* InterruptFlag() { return &interrupted; }
Status InterruptedStatus() { return CancelledStatus(); }
Watch InterruptWatch() { return {{}, InterruptFlag()}; }

}  // namespace kpsa::engine
