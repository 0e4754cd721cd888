// The engine's evaluator compiled once more, under other names, with everything left out that records: what
// recording_cost_test.cpp compares the shipped one with.
#pragma GCC diagnostic ignored "-Wnonnull"  // of what is never called
#define KPSA_WITHOUT_RECORDING
#define Evaluator EvaluatorWithoutRecording
#define EvaluatorOptions EvaluatorOptionsWithoutRecording
#define Workspace WorkspaceWithoutRecording
#include "tests/graph/evaluator_without_recording.h"

#include "graph/evaluator.cpp"
#include "graph/evaluator_run.cpp"

namespace kpsa::engine {

struct WithoutRecording::Impl {
  explicit Impl(std::shared_ptr<const Plan> plan) : evaluator(std::move(plan)) {}
  EvaluatorWithoutRecording evaluator;
};

WithoutRecording::WithoutRecording(std::shared_ptr<const Plan> plan)
    : impl_(std::make_unique<Impl>(std::move(plan))) {}
WithoutRecording::~WithoutRecording() = default;
void WithoutRecording::Invalidate() { impl_->evaluator.Invalidate(); }
Status WithoutRecording::Evaluate() { return impl_->evaluator.Evaluate(); }
double WithoutRecording::Get(Index output) const { return impl_->evaluator.Get<double>(output); }

}  // namespace kpsa::engine
