#include "kpsa/training/cue_description.h"

#include <algorithm>

#include "base/check.h"

namespace kpsa::engine {
namespace {

// Where output points are measured: stages that pass points through need not run.
const AccelerationTarget::Stage& OutputStage(const Graph& graph,
                                             const std::vector<AccelerationTarget::Stage>& stages) {
  std::size_t last = stages.size() - 1;
  while (last > 0 && graph.def(stages[last].points.node).passes_points) --last;
  return stages[last];
}

std::string ScalarName(const PoseRecorder& recorder, Index scalar) {
  const std::vector<Index> first = FirstScalars(recorder.signals(), recorder.layout());
  std::size_t s = first.size();
  while (s > 0 && first[s - 1] > scalar) --s;
  KPSA_CHECK(s > 0 && scalar < first[s - 1] + recorder.signals()[s - 1].entries());
  return EntryName(recorder.signals()[s - 1], scalar - first[s - 1]);
}

CueDescription Describe(const TrainingRig& rig, const PoseRecorder& recorder, std::span<const Index> totals,
                        CueRef cue) {
  CueDescription d;
  Index index = cue.index;
  if (cue.kind == CueKind::kScalar) {
    const PoseLayout& layout = recorder.layout();
    if (index < layout.products_begin() || index >= layout.relative_begin) {
      d.kind = CueDescription::Kind::kScalar;
      d.plug = ScalarName(recorder, index);
      return d;
    }
    d.kind = CueDescription::Kind::kProduct;
    const CueProduct& product = recorder.products()[index - layout.products_begin()];
    d.factors.push_back({ScalarName(recorder, product.a), product.of_a});
    if (product.b != kNoIndex) d.factors.push_back({ScalarName(recorder, product.b), product.of_b});
    d.lo = product.lo, d.hi = product.hi;
    return d;
  }
  const auto put = [&](std::size_t m, const AccelerationTarget::Stage& stage, Index point) {
    d.mesh = static_cast<Index>(m), d.stage = stage.name, d.point = point;
    return d;
  };
  if (cue.kind == CueKind::kOutput) {
    std::size_t m = 0;
    for (; index >= rig.rows(m, totals[m]); ++m) index -= rig.rows(m, totals[m]);
    return put(m, OutputStage(*rig.graph, rig.target.meshes[m].stages), rig.PointOf(m, index));
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
  const std::vector<Index> first = FirstScalars(recorder.signals(), recorder.layout());
  const auto found = std::ranges::find(first, cue.joint);
  KPSA_CHECK(found != first.end());
  description.joint = recorder.signals()[static_cast<std::size_t>(found - first.begin())].name;
  return description;
}

}  // namespace kpsa::engine
