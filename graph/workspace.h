// Memory that evaluations on one thread share: the buffers of lazy segments and the scratch of kernels. A
// workspace serves one plan and one evaluation at a time; evaluators that share one must run on the same
// thread.
#pragma once

#include "base/points.h"
#include "graph/plan.h"

namespace kpsa::engine {

class Evaluator;

class Workspace {
 public:
  explicit Workspace(const Plan& plan) : floats_(plan.workspace_floats()) {}
  float* data() { return floats_.data(); }
  std::size_t size() const { return floats_.size(); }

 private:
  friend class Evaluator;
  AlignedFloats floats_;
  const Evaluator* owner_ = nullptr;  // whose lazy values the buffers hold
};

}  // namespace kpsa::engine
