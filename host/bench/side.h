// One of the evaluations that a bench compares: its plan, its times, and what these consist of.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "graph/evaluator.h"
#include "host/bench/frame_times.h"
#include "host/watch.h"
#include "kpsa/kpsa_node.h"
#include "rig/build/rig_builder.h"

namespace kpsa::engine {

inline constexpr std::size_t kTurnFrames =
    128;  // of one side, before another runs them: some seconds of playback

// Steps with points that the outputs of these nodes need, themselves included.
std::vector<char> PointStepsAbove(const Plan& plan, const std::vector<NodeId>& nodes);

// What the steps of a plan took, by step; recording included.
struct RecordedSteps {
  std::vector<double> self_ns;
  std::vector<std::uint64_t> counts;
  KpsaTimes kpsa;
  double wall_ns = 0;  // of the frames, less what recording costs beside the steps
};
// Points that it computed, copies by helper steps and the KPSA nodes left out.
double PointsComputed(const Plan& plan, const RecordedSteps& recorded);

struct SideOptions {
  bool parallel = false;                      // steps and wide kernels on several threads
  std::size_t frames = 0;                     // that are timed, at most
  bool still = false;                         // nothing changes from frame to frame: all is evaluated anew
  const std::atomic<bool>* cancel = nullptr;  // of Watch
};

struct Side {
  const Rig& rig;
  std::shared_ptr<const Plan> plan;
  std::unique_ptr<Evaluator> evaluator;
  Index time = kNoIndex;
  FrameTimes times;
  bool anew = false;  // every evaluation: nothing changes from frame to frame
  bool one_thread = true;
  Watch watch;

  // Refers to the rig.
  Side(const Rig& of, std::shared_ptr<const Plan> made, const SideOptions& options);
  Status Evaluate(double t);  // errors: FailedAt
  // Before another pass over the frames: nodes that remember the previous one do not go back.
  void StartAgain() {
    if (!plan->stateful_node().empty()) evaluator->Restart();
  }
  // Frames [first, end) of `at`, timed.
  Status Turn(const std::vector<double>& at, std::size_t first, std::size_t end);
  // The same, recorded. A frame that something interrupted is evaluated again.
  Status RecordTurn(const std::vector<double>& at, std::size_t first, std::size_t end,
                    RecordedSteps* recorded);

 private:
  void Forget() {
    if (anew) evaluator->Invalidate();
  }
};

}  // namespace kpsa::engine
