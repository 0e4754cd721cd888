#include "kpsa/training/transform_ranges.h"

#include <algorithm>
#include <array>
#include <set>
#include <vector>

namespace kpsa::engine {
namespace {

constexpr int kPlaces = 7;  // of a control: rest, and others from its least to its most
constexpr int kSizes =
    3;  // of a scale, likewise; scales multiply what turns, so that they have places of their own

struct Axis {
  std::size_t control, axis;
  bool scale;
};

// The controls that are an axis of a transform's rotate, translate or scale.
std::vector<Axis> AxesOf(const TrainingRig& rig) {
  std::vector<Axis> axes;
  for (std::size_t c = 0; c < rig.controls.size(); ++c) {
    const PlugRef& plug = rig.controls[c].plug;
    if (plug.component < 0) continue;
    const NodeDef& def = rig.graph->def(plug.node);
    const std::string& name = def.attributes[static_cast<std::size_t>(plug.attribute)].name;
    if (name == "rotate" || name == "translate" || name == "scale")
      axes.push_back({c, static_cast<std::size_t>(plug.component), name == "scale"});
  }
  return axes;
}

// Of `places`, the first at rest.
double At(const ControlRange& control, int place, int places) {
  if (place == 0) return control.rest;
  const double least = std::min(control.min, control.rest - control.tilt);
  const double most = std::max(control.max, control.rest + control.tilt);
  return least + (most - least) * (place - 1) / (places - 2);
}

// All transforms at once, which do not change each other's local matrices; everything else at rest.
std::vector<SampledPose> PosesOf(const TrainingRig& rig, const std::vector<Axis>& axes) {
  SampledPose rest;
  for (const ControlRange& control : rig.controls) rest.values.push_back(control.rest);
  constexpr int kTurns = kPlaces * kPlaces * kPlaces;
  const int sizes = std::ranges::any_of(axes, &Axis::scale) ? kSizes : 1;
  std::vector<SampledPose> poses;
  for (int p = 0; p < kTurns * sizes; ++p) {
    const std::array<int, 3> turned{p % kPlaces, p / kPlaces % kPlaces, p / (kPlaces * kPlaces) % kPlaces};
    SampledPose& pose = poses.emplace_back(rest);
    for (const Axis& of : axes) {
      const ControlRange& control = rig.controls[of.control];
      pose.values[of.control] =
          of.scale ? At(control, p / kTurns, kSizes) : At(control, turned[of.axis], kPlaces);
    }
  }
  return poses;
}

}  // namespace

Status WidenByTransforms(const TrainingRig& rig, std::span<const Signal> guards, const PoseLayout& layout,
                         PoseRecorder* recorder, RangeFinder* ranges) {
  const std::vector<Axis> axes = AxesOf(rig);
  if (axes.empty()) return Status();
  std::set<Index> posed;
  for (const Axis& of : axes) posed.insert(rig.controls[of.control].plug.node.index);
  const std::vector<Index> first = FirstScalars(guards, layout);
  return recorder->VisitSignals(PosesOf(rig, axes), [&](std::span<const float> scalars) {
    for (std::size_t g = 0; g < guards.size(); ++g) {
      if (!guards[g].matrix || !posed.contains(guards[g].plug.node.index)) continue;
      ranges->Widen(first[g], scalars.subspan(static_cast<std::size_t>(first[g]), guards[g].entries()));
    }
  });
}

}  // namespace kpsa::engine
