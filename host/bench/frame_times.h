// Times of frames that a busy machine does not stretch.
//
// A frame is timed by the steady clock, which costs little beside it. Frames are evaluated in turns, and a
// turn is timed by the thread's CPU clock as well (a system call: beside a frame of 10 us it would show).
// What a turn took longer than the thread worked is taken off those of its frames that were longest beyond
// their shortest time of all runs: these were interrupted.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/median.h"

namespace kpsa::engine {

std::uint64_t ThreadCpuClock();  // nanoseconds that this thread has worked
double ClockCost();              // of a ProfileClock, nanoseconds, measured at the first call

// Takes `excess` off the times, the longest beyond their floors first, and none below its floor.
void TakeOff(double excess, std::span<const double> floors, std::span<double> times);

class FrameTimes {
 public:
  // `cpu`: by the time that this thread works; otherwise (frames on several threads) as they last.
  FrameTimes(std::size_t frames, bool cpu) : ns_(frames), cpu_(cpu) {}
  // A turn of frames in ascending order, each once a run.
  void BeginTurn(std::size_t first_frame);
  void Add(std::uint64_t ns);  // the next frame, by ProfileClock
  void EndTurn();
  // After all runs: the times of each frame, one a run. kinds: of each frame, those of one kind take about as long (a
  // frame that misses takes many times as long as one that hits); empty: all do. Only asked of a single run.
  const std::vector<std::vector<double>>& Finish(std::span<const int> kinds = {});
  const std::vector<std::vector<double>>& ns() const { return ns_; }
  double wall_ns() const { return wall_ns_; }  // of all turns
  double cpu_ns() const { return cpu_ns_; }    // 0 where the CPU clock is not used

 private:
  struct Turn {
    std::size_t first = 0, end = 0, run = 0;
    double excess = 0;
  };
  std::vector<std::vector<double>> ns_;
  std::vector<Turn> turns_;
  bool cpu_;
  std::size_t next_ = 0;
  std::uint64_t begin_wall_ = 0, begin_cpu_ = 0;
  double wall_ns_ = 0, cpu_ns_ = 0;
};

}  // namespace kpsa::engine
