// A rig with a clip that drives it (or none) and subspaces in place, as scenes share it: plans are made once
// for all scenes that ask for the same.
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/status.h"
#include "graph/compiler.h"
#include "graph/plan.h"
#include "host/acceleration.h"
#include "rig/build/rig_builder.h"

namespace kpsa::engine {

class Playing {
 public:
  // `settings` are set before the subspaces come in, which therefore know of them: what training did not know
  // misses.
  static Result<std::shared_ptr<Playing>> Make(const Rig& rest, const std::optional<std::string>& clip,
                                               std::span<const Setting> settings,
                                               const std::optional<AccelerationChoice>& acceleration);

  const Rig& rig() const { return rig_; }
  const std::vector<AppliedSubspace>& applied() const { return applied_; }
  // The points of all meshes that are shown, in their order, then what DecisionOf reads of each subspace;
  // time and the controls vary that neither the clip nor the rig drives.
  const Request& request() const { return request_; }
  Index first_decision() const { return first_decision_; }
  // Errors of the compiler and of evaluations, with the places of their nodes in the rig's files.
  Status Located(const Status& status) const;
  // Thread-safe. Errors have the places of the rig's files.
  Result<std::shared_ptr<const Plan>> PlanFor(const Request& request);

 private:
  explicit Playing(const Rig& rest) : rig_(rest) {}
  Rig rig_;
  std::vector<AppliedSubspace> applied_;
  Request request_;
  Index first_decision_ = 0;
  std::mutex mutex_;  // of what follows
  Compiler compiler_;
  std::vector<std::pair<Request, std::shared_ptr<const Plan>>> plans_;
};

}  // namespace kpsa::engine
