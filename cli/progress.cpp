#include "cli/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "cli/common.h"
#include "cli/interrupt.h"

namespace kpsa::engine {

Progress::Progress(std::string label, std::size_t total, bool quiet)
    : label_(std::move(label)),
      total_(total),
      shown_(!quiet && ::isatty(STDERR_FILENO) == 1),
      color_(std::getenv("NO_COLOR") == nullptr),
      start_(std::chrono::steady_clock::now()),
      begin_(start_),
      last_(start_) {}

Progress::~Progress() { Clear(); }

void Progress::Clear() {
  if (drawn_) std::fputs("\r\033[K", stderr), std::fflush(stderr);
  drawn_ = false;
}

void Progress::SetStage(const std::string& text) {
  if (!shown_) return;
  const auto now = std::chrono::steady_clock::now();
  Show(fmt::format("{} {}after {:.0f} s{}", text, color_ ? "\033[36m" : "",
                   std::chrono::duration<double>(now - start_).count(), color_ ? "\033[0m" : ""));
}

void Progress::SetLabel(std::string label, std::size_t total) {
  label_ = std::move(label);
  total_ = total;
  begin_ = std::chrono::steady_clock::now();
  last_ = begin_ - std::chrono::seconds(1);
}

void Progress::Set(std::size_t done) {
  if (!shown_) return;
  const auto now = std::chrono::steady_clock::now();
  if (now - last_ < std::chrono::milliseconds(100)) return;
  last_ = now;
  Draw(done);
}

Watch Progress::watch() {
  return {[this](std::size_t done, std::size_t) { Set(done); }, InterruptFlag()};
}

void Progress::Draw(std::size_t done) {
  constexpr std::size_t kWidth = 30;
  const double seconds = std::chrono::duration<double>(last_ - begin_).count();
  std::string line;
  if (total_ == 0) {
    line = fmt::format("{} {}", label_, done);
  } else {
    const std::size_t full = std::min(kWidth, done * kWidth / total_);
    std::string bar(full, '=');
    bar.resize(kWidth, ' ');
    line = fmt::format("{} {}[{}]{} {}/{}", label_, color_ ? "\033[36m" : "", bar, color_ ? "\033[0m" : "",
                       done, total_);
    // Before anything is done nobody knows
    if (done > 0)
      line += fmt::format("  {:.0f} s left", seconds * static_cast<double>(total_ - std::min(done, total_)) /
                                                 static_cast<double>(done));
  }
  Show(line);
}

void Progress::Show(const std::string& line) {
  std::fprintf(stderr, "\r\033[K%s", line.c_str());
  std::fflush(stderr);
  drawn_ = true;
}

}  // namespace kpsa::engine
