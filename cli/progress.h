// A progress bar on stderr, drawn only if that is a terminal; without colour where NO_COLOR is set.
#pragma once

#include <chrono>
#include <cstddef>
#include <string>

#include "host/watch.h"

namespace kpsa::engine {

class Progress {
 public:
  // `quiet`: draw nothing. A total of 0 means unknown: only the label and the count are shown.
  Progress(std::string label, std::size_t total, bool quiet);
  ~Progress();  // clears the line
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  // Draws at most ten times a second. One thread at a time.
  void Set(std::size_t done);
  // Of a call of the host: draws what it has done; an interrupt ends it. This must outlive it.
  Watch watch();
  void SetLabel(std::string label, std::size_t total);
  // A stage whose end nobody can tell: its text and how long everything took so far, drawn at once.
  void SetStage(const std::string& text);
  void Clear();  // the line; before anything else is printed

 private:
  void Draw(std::size_t done);
  void Show(const std::string& line);
  std::string label_;
  std::size_t total_;
  bool shown_, color_, drawn_ = false;
  std::chrono::steady_clock::time_point start_, begin_, last_;  // of all, of the label, of the last drawing
};

}  // namespace kpsa::engine
