// What a bench measured: times, errors and hits of one accelerated side, and the full one of the same run.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "base/types.h"
#include "host/bench/frame_errors.h"
#include "host/bench/idle.h"
#include "host/bench/promise.h"
#include "host/bench/reference.h"
#include "host/bench/tolerance_table.h"
#include "host/decisions.h"

namespace kpsa::engine {

struct BenchNode {
  std::string name, type;
  double ms_per_frame = 0;
  Index points = 0;
};

// How many times as long; not a number where that is unknown.
inline double Ratio(double ms, double shorter_ms) {
  return shorter_ms > 0 ? ms / shorter_ms : std::numeric_limits<double>::quiet_NaN();
}

// One accelerated side, and the full one of the same run.
struct BenchResult {
  std::vector<std::string> clips, trained_on,
      cue_stages;  // cue_stages: "face_mesh@skin: 40 points", "80 scalars"
  std::vector<std::string> notes;
  std::string subspace, mode;  // path and "map" or "paper", of the first subspace
  std::size_t frames = 0, points = 0, output_points = 0, cues = 0, modes = 0;  // points: accelerated
  std::size_t cue_points = 0;                 // of the cues; the others are scalars
  double bytes_per_point = 0, mean_rank = 0;  // that the reconstruction reads
  Promise promise;                            // with its tolerance
  bool light = false;                         // errors are numbers, and a frame's is its RMS
  struct Frame {
    std::string clip;
    std::int64_t number = 0;  // of the clip's frames
    FrameDecision decision;
    double rms = 0, max = 0, full_ms = 0, accelerated_ms = 0;
  };
  std::vector<Frame> per_frame;

  // Over the runs.
  struct Range {
    double least = 0, most = 0;
  };
  bool cpu_times = false;    // by the work of the thread; else as long as they lasted
  double wall_over_cpu = 1;  // the larger of both sides'; 1 where it is not known
  double full_ms = 0;        // a frame
  Range full_range, accelerated_range, speedup_range;
  std::vector<BenchNode> full_nodes, accelerated_nodes;  // what takes longest first; misses included
  double accelerated_ms = 0;
  double graph_ms = 0, cues_ms = 0, projection_ms = 0, reconstruction_ms = 0, downstream_ms = 0,
         misses_ms = 0;                     // its parts
  std::vector<std::vector<double>> cue_us;  // [subspaces][cues] parts of cues_ms (host/bench/cue_costs.h)
  double parts_ms = 0;  // as recorded: where they take longer than accelerated_ms, they are shown as shares
  double full_ms_on_hits = 0, accelerated_ms_on_hits = 0;
  double speedup() const { return Ratio(full_ms, accelerated_ms); }
  double speedup_on_hits() const { return Ratio(full_ms_on_hits, accelerated_ms_on_hits); }
  // What is left where cues, projection and reconstruction take no time: the graph and the later stages of
  // this side, as measured where all frames hit. With misses among them: of the full evaluation the steps
  // that this side's plan has, too, but for those with points above the accelerated ones.
  double bound_ms = 0, bound_graph_ms = 0, bound_points_ms = 0;
  double ceiling() const { return Ratio(full_ms, bound_ms); }

  std::size_t hits = 0, blends = 0;
  std::string most_frequent_reason;  // of frames that are no hits; "" where all are
  double error_rms = 0, error_max = 0, error_p99 = 0,
         diagonal = 0;     // metres, all points of all frames, misses included
  std::string worst_clip;  // "": nothing differs
  std::int64_t worst_frame = 0;
  double motion_rms = 0;                           // metres, distance from the mean over a clip's frames
  std::size_t nodes_total = 0;                     // that the full evaluation computes
  std::vector<std::string> never_evaluated;        // of these, in the accelerated one
  double points_full = 0, points_accelerated = 0;  // computed a frame, over all nodes but KPSA's
  ToleranceTable tolerances;                       // worst: blends by their shares
  ReferenceTable reference;                        // without rows where none is asked for
  FrameErrors frame_errors;                        // none where the subspaces keep no modes
  IdleDeformers idle;                              // none where it was not asked for
};

}  // namespace kpsa::engine
