#include "kpsa/training/clip_controls.h"

#include <algorithm>
#include <set>

#include "kpsa/training/training_signals.h"

namespace kpsa::engine {

Result<TrainingRig> WithClipControls(const TrainingRig& rig, const std::vector<TrainingClip>& clips) {
  TrainingRig with = rig;
  if (rig.by_clips.empty()) return with;
  with.by_clips.clear();
  Compiler compiler;
  const Result<TrainingSignals> signals = FindTrainingSignals(rig, &compiler, clips, false);
  if (!signals.ok()) return signals.status();
  std::set<Index> transforms;
  for (const Signal& signal : signals->watched) {
    if (signal.matrix) transforms.insert(signal.plug.node.index);
  }
  for (const ControlRange& control : rig.by_clips) {
    if (transforms.contains(control.plug.node.index) ||
        std::ranges::find(signals->watched, control.plug, &Signal::plug) != signals->watched.end())
      with.controls.push_back(control);
  }
  return with;
}

}  // namespace kpsa::engine
