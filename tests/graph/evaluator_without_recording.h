// An evaluator that cannot record, for the test of what recording costs while it is off.
#pragma once

#include <memory>

#include "base/status.h"
#include "graph/plan.h"

namespace kpsa::engine {

class WithoutRecording {
 public:
  explicit WithoutRecording(std::shared_ptr<const Plan> plan);
  ~WithoutRecording();
  void Invalidate();
  Status Evaluate();
  double Get(Index output) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace kpsa::engine
