// Whether the frames of a bench kept what the calibration promises: at most a share of all frames is accepted
// (a hit or a blend) although its error is beyond the tolerance, and at most twice that share of the hits.
// Frames of a clip resemble each other, so these are rates of the clip, and no estimate for others.
#pragma once

#include <string>
#include <vector>

#include "host/verdicts.h"

namespace kpsa::engine {

struct Promise {
  double tolerance = 0;  // kAnyError: nothing is promised
  double rate = 0;       // promised, of all frames
  bool light = false;    // errors are numbers, and a frame's is its RMS
  std::size_t frames = 0, hits = 0, beyond = 0, hits_beyond = 0;
  // The accepted frame with the largest error.
  std::string worst_clip;  // "": none was accepted
  std::int64_t worst_frame = 0;
  double worst_error = 0;

  // The tolerance and the rate of the entries: of several, the largest tolerance and the sum of the rates.
  void Make(const std::vector<AppliedSubspace>& applied);
  // `accepted`: a node reconstructed something of it.
  void Add(const std::string& clip, std::int64_t frame, bool hit, bool accepted, double error);
  double hit_rate() const { return 2 * rate; }  // promised, of the hits
  bool promised() const;
  bool kept() const;                 // also where nothing is promised
  double beyond_share() const;       // of all frames
  double hits_beyond_share() const;  // of the hits
};

}  // namespace kpsa::engine
