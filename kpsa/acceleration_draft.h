// What a KPSA node will be, worked out before the graph is touched: whether the subspace fits the rig, what
// its guards watch, where its cues lie. Internal to kpsa/accelerate.
#pragma once

#include "kpsa/accelerate.h"

namespace kpsa::engine {

struct AccelerationDraft {
  KpsaConfig::Data data;
  std::vector<PlugRef> cues;              // by data.cues
  std::vector<Signal> matrices, scalars;  // guards and cues, by input of the node
  std::vector<std::string> notes;
  void AlwaysMiss(const std::string& reason) {
    if (!data.always_miss) data.always_miss_reason = reason;
    data.always_miss = true;
    notes.push_back(reason + ": every frame is evaluated fully");
  }
};

// Errors as of Accelerator::Add.
Result<AccelerationDraft> DraftAcceleration(const Graph& graph, Compiler* compiler,
                                            const AccelerationTarget& target,
                                            std::shared_ptr<const Subspace> subspace,
                                            const AccelerateOptions& options);

}  // namespace kpsa::engine
