#include "host/run_up.h"

#include <cmath>

namespace kpsa::engine {
namespace {
constexpr double kSameFrame = 1e-6;  // of a frame
}  // namespace

Status RunUp::To(double seconds, Evaluator* evaluator) {
  if (!stateful_) {
    Set(seconds, evaluator);
    return Status();
  }
  if (!at_.has_value() || seconds < *at_) {
    evaluator->Restart();
    at_.reset();
  }
  const double first = at_.has_value() ? std::floor(*at_ * fps_ + kSameFrame) + 1 : 0;
  if (seconds * fps_ - first > kMostFrames)
    return Status::Usage("\"{}\" needs its previous frame, and {} s lies more than {} frames ahead",
                         evaluator->plan().stateful_node(), seconds, kMostFrames)
        .OfNode(evaluator->plan().stateful_node());
  for (double frame = first; frame < seconds * fps_ - kSameFrame; ++frame) {
    Set(frame / fps_, evaluator);
    if (const Status status = evaluator->Evaluate(); !status.ok()) {
      at_.reset();
      const Error& error = status.errors().front();
      return Status::Evaluation("at {} s: {}", frame / fps_, error.message).OfNode(error.node);
    }
  }
  Set(seconds, evaluator);
  at_ = seconds;
  return Status();
}

}  // namespace kpsa::engine
