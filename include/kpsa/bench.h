// What acceleration gains on frames of clips, and what it costs in errors.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace kpsa {

struct BenchOptions {
  std::vector<std::string> clips =
      {};        // none: the test clips of the rig; where it names none, its first clip
  int runs = 5;  // timed evaluations of every frame; a frame's time is their median
  // Of one evaluation, and of the whole process while this runs. Of one thread times are those of its work, whatever
  // else the machine does. 1 where functions of the program compute (kpsa/node_type.h).
  int threads = 1;
  // How many frames have been evaluated or timed so far, on the thread that benches; false cancels, and is the last
  // call.
  std::function<bool(std::size_t frames)> progress = {};
};

// Over every frame of the clips. Times are milliseconds a frame, errors metres (of light, numbers) between final
// points, misses included, of the accelerated evaluation from the full one.
struct BenchReport {
  std::vector<std::string> clips = {};  // that were played
  std::size_t frames = 0;
  std::size_t hits = 0, blends = 0;       // all others are misses
  std::string most_frequent_reason = {};  // of frames that are no hits; "" where all are
  double full_ms = 0, accelerated_ms = 0;
  double speedup = 0;          // full_ms / accelerated_ms, misses included
  double speedup_on_hits = 0;  // of frames that hit alone; 0 where none does
  double error_rms = 0, error_max = 0;
  // Promised: at most this share of frames is a hit or a blend and yet farther off than the tolerance, and at most twice
  // the share of the hits. A tolerance of infinity promises nothing, and nothing is broken then.
  double tolerance = 0, violation_rate = 0;
  std::size_t beyond_tolerance = 0;  // accepted frames that are
  bool promise_kept = true;
  std::vector<std::string> notes = {};  // what may surprise, a sentence each

  double hit_rate() const {
    return frames == 0 ? 0 : static_cast<double>(hits) / static_cast<double>(frames);
  }
};

}  // namespace kpsa
