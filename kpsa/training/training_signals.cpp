#include "kpsa/training/training_signals.h"

#include <algorithm>
#include <utility>

namespace kpsa::engine {
namespace {

void AddUnknown(std::vector<Signal> found, std::vector<Signal>* known) {
  for (Signal& signal : found) {
    if (std::ranges::find(*known, signal.name, &Signal::name) == known->end())
      known->push_back(std::move(signal));
  }
}

}  // namespace

Result<TrainingSignals> FindTrainingSignals(const TrainingRig& rig, Compiler* compiler,
                                            const std::vector<TrainingClip>& clips, bool with_relative) {
  TrainingSignals signals;
  for (int clip = -1; clip < static_cast<int>(clips.size()); ++clip) {
    if (clip >= 0) KPSA_RETURN_IF_ERROR(rig.set_clip(clips[static_cast<std::size_t>(clip)].name));
    std::vector<PlugRef> varying{rig.time};
    for (const ControlRange& control : rig.controls) {
      if (clip < 0 || !control.by_clip) varying.push_back(control.plug);
    }
    Result<std::vector<Signal>> found =
        FindSignals(*rig.graph, compiler, rig.target.outputs(), varying, {}, nullptr);
    if (!found.ok()) return found.status();
    AddUnknown(std::move(*found), &signals.watched);
    if (!with_relative) continue;
    Result<std::vector<Signal>> matrices =
        FindRelativeMatrices(*rig.graph, compiler, rig.target.outputs(), varying);
    if (!matrices.ok()) return matrices.status();
    AddUnknown(std::move(*matrices), &signals.relative);
  }
  for (std::vector<Signal>* list : {&signals.watched, &signals.relative})
    std::ranges::sort(*list, {}, &Signal::name);
  KPSA_RETURN_IF_ERROR(rig.set_clip(std::nullopt));
  return signals;
}

}  // namespace kpsa::engine
