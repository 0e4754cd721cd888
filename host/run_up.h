// Nodes that need their previous frame (NodeDef::stateful), brought to any time.
#pragma once

#include <atomic>
#include <functional>
#include <optional>
#include <utility>

#include "graph/evaluator.h"
#include "host/watch.h"
#include "rig/build/rig_builder.h"

namespace kpsa::engine {

// The times of one evaluator. A plan without such nodes takes any time as it is; then a RunUp may be used by several
// threads, on evaluators of their own.
class RunUp {
 public:
  // The evaluator's plan is of that rig, in which the scene's time may vary. cancel: as Watch's; go_on, where there is
  // one, is asked before every frame on the way, and false ends it as cancel does.
  RunUp(const Plan& plan, const Rig& rig, const std::atomic<bool>* cancel = nullptr,
        std::function<bool()> go_on = {})
      : rig_(rig),
        stateful_(!plan.stateful_node().empty()),
        time_(plan.FindVarying(rig.scene.time)),
        watch_{{}, cancel},
        go_on_(std::move(go_on)) {}

  // Sets the time, in seconds, after all outputs were evaluated at every frame of the rig before it: from frame 0
  // on, or from the frame at which the evaluator was; a time before that, or after one between frames, starts anew.
  // What is set stays as it is. Errors: of that output at these frames, or of any where none is named; kMostFrames.
  Status To(double seconds, Evaluator* evaluator, std::optional<Index> output = std::nullopt);
  bool stateful() const { return stateful_; }
  static constexpr double kMostFrames = 1e6;  // of one call

 private:
  void Set(double seconds, Evaluator* evaluator) const {
    if (time_ != kNoIndex) evaluator->Set(time_, seconds);
  }

  const Rig& rig_;
  bool stateful_;
  Index time_;
  Watch watch_;
  std::function<bool()> go_on_;
  std::optional<double> at_;  // where the evaluator is
};

}  // namespace kpsa::engine
