// One accelerated side of a bench, over all its clips.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "graph/evaluator.h"
#include "host/acceleration.h"
#include "host/bench/bench_result.h"
#include "host/bench/cue_costs.h"
#include "host/bench/point_errors.h"
#include "host/bench/side.h"
#include "host/bench/tolerances.h"
#include "host/open_rig.h"
#include "host/verdicts.h"

namespace kpsa::engine {

// Sums over clips; divided by frames at the end.
struct BenchSums {
  double full_ns = 0, accelerated_ns = 0, full_hit_ns = 0, accelerated_hit_ns = 0;
  double graph = 0, cues = 0, projection = 0, reconstruction = 0, downstream = 0, misses = 0, bound_graph = 0,
         bound_points = 0;
  double points_full = 0, points_accelerated = 0;
  double parts = 0;                                     // as recorded
  std::vector<double> full_run_ns, accelerated_run_ns;  // by run
  double full_wall = 0, full_cpu = 0, wall = 0, cpu = 0;
  std::map<std::string, BenchNode> nodes, accelerated_nodes;
  std::set<std::string> computed;
};

// One accelerated side: what is summed over the clips, and what belongs to the present one.
struct Contender {
  AccelerationChoice choice;
  BenchResult result;
  PointErrors errors;
  BenchSums sums;
  Reasons reasons;

  std::unique_ptr<OpenRig> open;
  std::vector<AppliedSubspace> applied;
  Request request;
  std::size_t compared = 0;  // outputs
  std::unique_ptr<Verdicts> verdicts;
  std::unique_ptr<Side> side;
  PointErrors clip_errors;
  FullWeights weights;
  CueCosts cue_costs;
  BenchTolerances tolerances;

  // The rig with the subspaces in place. `outputs` becomes what the full side has to compute.
  // Where nothing moves, the controls vary.
  Status Load(const RigOpener& opener, const RigChange& clip, const SideOptions& options, Request* outputs);
  void Describe();
  void Compare(std::int64_t frame, const Evaluator& full, const std::string& clip);
  void NoteClip(const std::string& clip, bool still);
  std::vector<int> KindsOfFrames(std::size_t frames) const;  // of the last clip: FrameTimes::Finish
  void AddTimes(const FrameTimes& full);
  void AddFullProfile(const Plan& plan, const RecordedSteps& recorded, double full_ns);
  void AddProfile(const RecordedSteps& recorded, double fast_ns);
  void Finish(double wanted_speedup);  // 0: none
};

}  // namespace kpsa::engine
