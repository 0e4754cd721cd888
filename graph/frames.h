// Evaluation of many frames on several threads. Every thread owns a workspace and a block of evaluators; it
// takes the next block of frames, evaluates it, and hands the frames on in order.
//
// Within a block: eager steps and decide for each frame; then steps with a ComputeGroup::compute_block run
// once over all frames of the block that chose no lazy input (frames that did run by themselves, with the
// chosen segments); then the rest of each frame. The results are the same bytes for any number of threads,
// block size and order of frames.
//
// A thread waits for its turn before it takes another block, so that no more than threads * block frames
// exist at once.
#pragma once

#include <atomic>
#include <functional>
#include <memory>

#include "base/status.h"
#include "graph/evaluator.h"
#include "graph/plan.h"
#include "graph/profile.h"

namespace kpsa::engine {

struct FrameOptions {
  int threads = 0;  // 0: as many as ParallelFor may use
  int block =
      8;  // frames that a thread evaluates side by side; shortened where there are too few for all threads
  const std::atomic<bool>* cancel = nullptr;  // looked at between frames, and in nodes that take long
  Profile* profile = nullptr;                 // records all frames, with their numbers
};

// Sets what varies, for a frame. It is called on several threads at once, on different evaluators, which held
// other frames before: set the same plugs for every frame.
using SetFrame = std::function<void(std::size_t frame, Evaluator& evaluator)>;

// Takes the outputs of a frame, or the error of its evaluation: one frame's failure does not touch the
// others. Called in ascending order of frames, one call at a time, on any of the threads. An error that it
// returns ends everything.
using FrameSink =
    std::function<Status(std::size_t frame, const Evaluator& evaluator, const Status& evaluated)>;

// Evaluates all outputs of the plan for frames 0 to frame_count - 1. Errors: the sink's, or kInterrupted
// after a cancellation; the sink has then seen the first frames without a gap. What `set`, `sink` or an allocation
// throws ends everything, too, and is a kEvaluation error with the number of its frame; what a node throws is an error
// of that node at that frame. Where there is no memory for another thread, those that are there do all. A plan with a
// stateful node (Plan::stateful_node) or one of the host program (Plan::prototype_node) is evaluated on one evaluator,
// whatever the options say.
Status EvaluateFrames(const std::shared_ptr<const Plan>& plan, std::size_t frame_count,
                      const FrameOptions& options, const SetFrame& set, const FrameSink& sink);

}  // namespace kpsa::engine
