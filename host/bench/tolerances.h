// What the frames of a bench would be at other tolerances, without evaluating them at each: one more
// evaluation at a tolerance that accepts all that any of them accepts. There every frame has its score, and
// what guards ask for; at a smaller tolerance the share of the full evaluation is the larger of that and of
// what the smaller threshold asks for. (Of a character that is scaled the threshold is its own.)
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "host/acceleration.h"
#include "host/bench/side.h"
#include "host/bench/tolerance_table.h"
#include "host/open_rig.h"
#include "host/verdicts.h"

namespace kpsa::engine {

class BenchTolerances {
 public:
  // A side that is compared: its first outputs are those that the full side has, too.
  struct Compared {
    const AccelerationChoice* choice = nullptr;
    const std::vector<AppliedSubspace>* applied = nullptr;  // at the tolerance in force
    const Request* request = nullptr;
    std::size_t outputs = 0;
  };
  // Anew for every clip. Where the tolerance in force is 0 or any, nothing is evaluated.
  Status Load(const RigOpener& opener, const RigChange& clip, const Compared& compared,
              const SideOptions& options);
  // A frame of the clip, which the full side has evaluated.
  Status AddFrame(double time, std::int64_t frame, const Evaluator& full);
  // For a clip none of whose frames hits at the tolerance in force: times those that do here.
  Status TimeHits(const std::vector<double>& times);

  // hit_ms: of a hit; 0: as TimeHits found, if it did. mean_ms: of all frames, which says what one costs
  // where parts miss by themselves. wanted_speedup 0: none.
  ToleranceTable Table(double full_ms, double hit_ms, double mean_ms, double wanted_speedup) const;

 private:
  struct Subspaces {  // of one node
    std::shared_ptr<const Subspace> subspace;
    double tolerance = 0, violation_rate = 0;
  };
  struct Frame {
    std::vector<FrameDecision> nodes;  // at the wide tolerance
    std::vector<double> errors;        // emitted there, by output
  };
  ToleranceRow At(double tolerance, double full_ms, double hit_ms, double miss) const;
  double CostOfMiss(double full_ms, double hit_ms, double mean_ms) const;  // of a full evaluation

  std::vector<Subspaces> nodes_;
  double in_force_ = 0, wide_ = 0;
  bool light_ = false;
  std::vector<Frame> frames_;
  std::size_t clip_begin_ = 0;  // in frames_
  double hit_ns_ = 0;           // of timed_hits_ frames
  std::size_t timed_hits_ = 0;

  std::unique_ptr<OpenRig> open_;  // of the clip
  std::vector<AppliedSubspace> applied_;
  std::unique_ptr<Verdicts> verdicts_;
  std::unique_ptr<Side> side_;
  std::vector<std::size_t> node_of_output_;  // or as many as there are nodes: of none, it depends on any
};

}  // namespace kpsa::engine
