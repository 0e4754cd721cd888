#include "kpsa/cue_description.h"

#include "base/check.h"

namespace kpsa {
namespace {

// Where output points are measured: stages that pass points through need not run.
const AccelerationTarget::Stage& OutputStage(const Graph& graph,
                                             const std::vector<AccelerationTarget::Stage>& stages) {
  std::size_t last = stages.size() - 1;
  while (last > 0 && graph.def(stages[last].points.node).passes_points) --last;
  return stages[last];
}

CueDescription Describe(const TrainingRig& rig, const PoseRecorder& recorder, std::span<const Index> totals,
                        CueRef cue) {
  CueDescription d;
  Index index = cue.index;
  if (cue.kind == CueKind::kScalar) {
    d.kind = CueDescription::Kind::kScalar;
    for (const Signal& signal : recorder.signals()) {
      if (index < signal.entries()) {
        d.plug = EntryName(signal, index);
        return d;
      }
      index -= static_cast<Index>(signal.entries());
    }
    KPSA_CHECK(false);
  }
  const auto put = [&](std::size_t m, const AccelerationTarget::Stage& stage, Index point) {
    d.mesh = static_cast<Index>(m), d.stage = stage.name, d.point = point;
    return d;
  };
  if (cue.kind == CueKind::kOutput) {
    std::size_t m = 0;
    for (; index >= totals[m]; ++m) index -= totals[m];
    return put(m, OutputStage(*rig.graph, rig.target.meshes[m].stages), index);
  }
  for (const CandidateStage& candidate : recorder.candidates()) {
    if (index < candidate.points.size())
      return put(candidate.mesh, rig.target.meshes[candidate.mesh].stages[candidate.stage],
                 candidate.points[index]);
    index -= static_cast<Index>(candidate.points.size());
  }
  KPSA_CHECK(false);
  return d;
}

}  // namespace

CueDescription DescribeCue(const TrainingRig& rig, const PoseRecorder& recorder,
                           std::span<const Index> totals, CueRef cue) {
  CueDescription description = Describe(rig, recorder, totals, cue);
  if (cue.joint == kNoIndex) return description;
  Index first = 0;
  for (const Signal& signal : recorder.signals()) {
    if (first == cue.joint) description.joint = signal.name;
    first += static_cast<Index>(signal.entries());
  }
  return description;
}

}  // namespace kpsa
