#include "host/run_up.h"

#include <cmath>

#include "host/rig_frames.h"

namespace kpsa::engine {
namespace {

constexpr double kSameFrame = 1e-6;  // of a frame

}  // namespace

Status RunUp::To(double seconds, Evaluator* evaluator, std::optional<Index> output) {
  if (!stateful_) {
    Set(seconds, evaluator);
    return Status();
  }
  const double here = at_.value_or(0) * rig_.fps, there = seconds * rig_.fps;
  const bool at_frame = at_.has_value() && here >= 0 && std::abs(here - std::round(here)) <= kSameFrame;
  if (!at_.has_value() || seconds < *at_ || (seconds > *at_ && !at_frame)) {
    evaluator->Restart();
    at_.reset();
  }
  const double first = at_.has_value() ? std::round(here) + 1 : 0;
  if (there - first > kMostFrames)
    return Status::Usage("\"{}\" needs its previous frame, and {} s lies more than {} frames ahead",
                         evaluator->plan().stateful_node(), seconds, kMostFrames)
        .OfNode(evaluator->plan().stateful_node());
  for (double frame = first; frame < there - kSameFrame; ++frame) {
    Set(frame / rig_.fps, evaluator);
    const bool ended = watch_.cancelled() || (go_on_ && !go_on_());
    Status status = ended ? CancelledStatus() : evaluator->Evaluate();
    if (!status.ok() && status.kind() == ErrorKind::kEvaluation && output.has_value())
      status = evaluator->Pull(*output);
    if (status.ok()) continue;
    at_.reset();
    return status.kind() == ErrorKind::kInterrupted ? status : FailedAt(rig_, frame / rig_.fps, status);
  }
  Set(seconds, evaluator);
  at_ = seconds;
  return Status();
}

}  // namespace kpsa::engine
