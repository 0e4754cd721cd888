#include "kpsa/training/transform_ranges.h"

#include <algorithm>
#include <array>
#include <set>

namespace kpsa::engine {
namespace {

constexpr int kPlaces = 7;  // of a control: rest, and others from its least to its most
constexpr int kSizes = 3;   // likewise, of a scale: rest, least, most

// The axis of a transform's rotate, translate or scale that the control is; -1: another plug. Sizes multiply what turns, so
// that they have places of their own, the same for all three.
int AxisOf(const Graph& graph, const PlugRef& plug, bool* size) {
  if (plug.component < 0 || plug.attribute < 0) return -1;
  const NodeDef& def = graph.def(plug.node);
  const std::string& name = def.attributes[static_cast<std::size_t>(plug.attribute)].name;
  *size = name == "scale";
  return name == "rotate" || name == "translate" || *size ? plug.component : -1;
}

// Of `places`, the first at rest.
double At(const ControlRange& control, int place, int places) {
  if (place == 0) return control.rest;
  const double least = std::min(control.min, control.rest - control.tilt);
  const double most = std::max(control.max, control.rest + control.tilt);
  return least + (most - least) * (place - 1) / (places - 2);
}

}  // namespace

std::vector<SampledPose> PlacesOfTransforms(const TrainingRig& rig) {
  bool any = false, any_size = false, size = false;
  for (const ControlRange& control : rig.controls) {
    any = AxisOf(*rig.graph, control.plug, &size) >= 0 || any;
    any_size = any_size || size;
  }
  std::vector<SampledPose> poses;
  if (!any) return poses;
  const int turns = kPlaces * kPlaces * kPlaces;
  for (int p = 0; p < turns * (any_size ? kSizes : 1); ++p) {
    const std::array<int, 3> turned{p % kPlaces, p / kPlaces % kPlaces, p / (kPlaces * kPlaces) % kPlaces};
    SampledPose& pose = poses.emplace_back();
    for (const ControlRange& control : rig.controls) {
      const int axis = AxisOf(*rig.graph, control.plug, &size);
      pose.values.push_back(axis < 0 ? control.rest
                            : size   ? At(control, p / turns, kSizes)
                                     : At(control, turned[static_cast<std::size_t>(axis)], kPlaces));
    }
  }
  return poses;
}

Status WidenByTransforms(const TrainingRig& rig, std::span<const Signal> guards, const PoseLayout& layout,
                         PoseRecorder* recorder, RangeFinder* ranges) {
  std::set<Index> posed;
  bool size = false;
  for (const ControlRange& control : rig.controls) {
    if (AxisOf(*rig.graph, control.plug, &size) >= 0) posed.insert(control.plug.node.index);
  }
  const std::vector<Index> first = FirstScalars(guards, layout);
  return recorder->VisitSignals(PlacesOfTransforms(rig), [&](std::span<const float> scalars) {
    for (std::size_t g = 0; g < guards.size(); ++g) {
      if (!guards[g].matrix || !posed.contains(guards[g].plug.node.index)) continue;
      ranges->Widen(first[g], scalars.subspan(static_cast<std::size_t>(first[g]), guards[g].entries()));
    }
  });
}

}  // namespace kpsa::engine
