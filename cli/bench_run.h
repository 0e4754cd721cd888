// Full against accelerated evaluation of the same frames, in one process.
//
// For every clip: one pass compares the points (and warms both sides up), some runs are timed, one pass is
// profiled. Timed frames of the two sides alternate, so that whatever else the machine does hits both. A
// frame's time is the median over the runs; a clip's is the mean over its frames.
#pragma once

#include <string>
#include <vector>

#include "cli/acceleration.h"
#include "graph/plan_report.h"

namespace kpsa {

struct BenchOptions {
  int runs = 5;
  int threads = 1;  // more: both sides evaluate steps and wide kernels in parallel
  bool quiet = false;
};

struct BenchNode {
  std::string name, type;
  double ms_per_frame = 0;
  Index points = 0;
};

struct BenchResult {
  std::vector<std::string> clips, trained_on,
      cue_stages;  // cue_stages: "face_mesh@skin: 40 points", "80 scalars"
  std::vector<std::string> notes;
  std::size_t frames = 0, points = 0, output_points = 0, cues = 0, modes = 0;  // points: accelerated
  double tolerance = 0, violation_limit = 0;                                   // of the first subspace
  bool light = false;  // errors are numbers, and a frame's is its RMS
  struct Frame {
    std::string clip;
    std::size_t number = 0;
    bool hit = false;
    double rms = 0, max = 0, full_ms = 0, accelerated_ms = 0;
  };
  std::vector<Frame> per_frame;

  double full_ms = 0;  // a frame
  std::vector<BenchNode> full_nodes;
  double accelerated_ms = 0;
  double graph_ms = 0, cues_ms = 0, projection_ms = 0, reconstruction_ms = 0, downstream_ms = 0,
         misses_ms = 0;  // its parts
  double full_ms_on_hits = 0, accelerated_ms_on_hits = 0;
  double speedup() const { return accelerated_ms > 0 ? full_ms / accelerated_ms : 0; }
  double speedup_on_hits() const {
    return accelerated_ms_on_hits > 0 ? full_ms_on_hits / accelerated_ms_on_hits : 0;
  }
  // What no subspace can skip: the full evaluation without the steps with points above the accelerated ones.
  double bound_ms = 0, bound_graph_ms = 0, bound_points_ms = 0;
  double ceiling() const { return bound_ms > 0 ? full_ms / bound_ms : 0; }

  std::size_t hits = 0, violations = 0;  // violations: accepted frames with a point beyond the tolerance
  std::string verdict_text, worst_miss;
  double error_rms = 0, error_max = 0, error_p99 = 0,
         diagonal = 0;  // metres, all points of all frames, misses included
  std::string worst_clip;
  std::size_t worst_frame = 0;
  double motion_rms = 0;                           // metres, distance from the mean over a clip's frames
  std::size_t nodes_total = 0;                     // that the full evaluation computes
  std::vector<std::string> never_evaluated;        // of these, in the accelerated one
  double points_full = 0, points_accelerated = 0;  // computed a frame, over all nodes but KPSA's
};

// Every frame of the clips ("": the one that the flags choose), or the times of the flags. The rig is loaded
// anew for each.
Result<BenchResult> RunBench(const Flags& flags, const AccelerationFlags& acceleration,
                             const std::vector<std::string>& clips, const BenchOptions& options);

}  // namespace kpsa
