// What a compute may ask the evaluator for. Internal to graph/.
#pragma once

#include "base/cancel.h"
#include "graph/evaluator.h"

namespace kpsa::engine {

// One on the stack for every run, so that a failure knows its step.
class Evaluator::StepHost final : public ComputeHost {
 public:
  StepHost(Evaluator* evaluator, Index step) : step(step), evaluator_(evaluator) {}
  void Fail(std::string_view message) override {
    failed = true;
    evaluator_->RecordFailure(step, message);
  }
  void For(std::size_t count, std::size_t grain, RangeBody body) override {
    if (evaluator_->options_.parallel) {
      ParallelFor(count, grain, body);
    } else {
      body(0, count);
    }
  }
  void Check(const SlotAccess& access) const override {
    if (const StepShape* shape = evaluator_->plan_->shape(step)) shape->Check(access);
  }
  bool recording() const override { return evaluator_->profile_ != nullptr; }
  void AddPart(int part, std::uint64_t ns) override {
    if (evaluator_->profile_ != nullptr) evaluator_->profile_->AddPart(step, part, ns);
  }
  // Calls what a node's author wrote. An exception of it is a failure of the step: it may run on a thread that nobody
  // watches, and ends in none of the evaluator's own code.
  template <typename F>
  void Guard(const ComputeContext& context, const F& function) {
    try {
      function();
    } catch (...) {
      FailOfThrown(context);
    }
  }
  // In a catch block: of the exception that is being handled.
  [[gnu::noinline, gnu::cold]] void FailOfThrown(const ComputeContext& context) {
    try {
      throw;
    } catch (const Cancelled&) {
      failed = true;
      evaluator_->RecordCancelled(step);
    } catch (...) {
      Fail(ThrownByStep(evaluator_->plan_->shape(step), context));
    }
  }
  bool failed = false;
  Index step;

 private:
  Evaluator* evaluator_;
};

}  // namespace kpsa::engine
