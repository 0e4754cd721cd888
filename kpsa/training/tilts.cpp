#include "kpsa/training/tilts.h"

#include <algorithm>
#include <map>

#include "kpsa/training/random.h"
#include "kpsa/training/space_points.h"

namespace kpsa::engine {
namespace {

constexpr double kTiltShare = 0.01;  // of the ranges of the axes that are controlled, together
constexpr double kMostTilt = 0.03;   // radians
constexpr double kShiftShare = 0.05,
                 kShiftOfLeast = 0.5;  // likewise of shifts; and of the least range, at most

// Of three controls about the axes of a transform, the one that turns least.
void TiltTheThird(const std::size_t of_axes[3], std::vector<ControlRange>* controls) {
  const auto half = [&](std::size_t c) { return ((*controls)[c].max - (*controls)[c].min) / 2; };
  std::size_t by_range[] = {of_axes[0], of_axes[1], of_axes[2]};
  std::stable_sort(std::begin(by_range), std::end(by_range),
                   [&](std::size_t a, std::size_t b) { return half(a) < half(b); });
  const double tilt = std::min(kMostTilt, half(by_range[1]) * half(by_range[2]) / 2);
  if (half(by_range[0]) < tilt) (*controls)[by_range[0]].tilt = tilt;
}

// What the controls of a transform do of one kind, by axis.
struct Moved {
  NodeId node;
  double range = 0;
  bool axes[3] = {false, false, false};
  std::size_t controls[3] = {};
};

std::map<Index, Moved> MovedBy(const TrainingRig& rig, const char* attribute) {
  std::map<Index, Moved> moved;
  for (std::size_t i = 0; i < rig.controls.size(); ++i) {
    const ControlRange& control = rig.controls[i];
    const int c = control.plug.component;
    if (control.plug.attribute != rig.graph->def(control.plug.node).FindAttribute(attribute) || c < 0 ||
        c > 2)
      continue;
    Moved& of = moved[control.plug.node.index];
    of.node = control.plug.node;
    of.range += control.max - control.min;
    of.axes[c] = true;
    of.controls[c] = i;
  }
  return moved;
}

// A control for each axis that has none, of those plugs.
void AddAxes(const Moved& of, const std::vector<PlugRef>& plugs, double tilt, TrainingRig* with) {
  for (std::size_t c = 0; c < plugs.size(); ++c) {
    if (of.axes[c]) continue;
    const Value* set = with->graph->FindValue(plugs[c]);
    const double rest = set != nullptr && set->get_if<double>() != nullptr ? set->get<double>() : 0;
    with->controls.push_back({plugs[c], rest - tilt, rest + tilt, rest});
  }
}

}  // namespace

TrainingRig WithTilts(const TrainingRig& rig) {
  TrainingRig with = rig;
  if (rig.target.colors) return with;
  const std::map<Index, Moved> turned = MovedBy(rig, "rotate");
  for (const auto& [index, of] : turned) {
    const int count = of.axes[0] + of.axes[1] + of.axes[2];
    if (count == 3) TiltTheThird(of.controls, &with.controls);
    if (count == 2)
      AddAxes(of, FreePlugs(*rig.graph, of.node).rotate, std::min(kMostTilt, kTiltShare * of.range), &with);
  }
  for (const auto& [index, of] : MovedBy(rig, "translate")) {
    if (!turned.contains(index)) continue;
    const auto range = [&](std::size_t c) {
      const ControlRange& control = rig.controls[of.controls[c]];
      return of.axes[c] ? control.max - control.min : 0;
    };
    double least = of.range;  // of the axes that have one
    for (std::size_t c = 0; c < 3; ++c) {
      if (range(c) > 0) least = std::min(least, range(c));
    }
    const double shift = std::min(kShiftShare * of.range, kShiftOfLeast * least);
    if (shift == 0) continue;
    for (std::size_t c = 0; c < 3; ++c) {
      if (of.axes[c] && range(c) == 0) with.controls[of.controls[c]].tilt = shift;
    }
    AddAxes(of, FreePlugs(*rig.graph, of.node).translate, shift, &with);
  }
  return with;
}

void AddTilts(const std::vector<ControlRange>& controls, std::size_t drawn, std::uint64_t seed,
              std::vector<SampledPose>* poses) {
  const bool turned = std::any_of(controls.begin(), controls.end(),
                                  [](const ControlRange& control) { return control.tilt > 0; });
  if (controls.size() == drawn && !turned) return;
  Random random(seed ^ 0x3c6ef372fe94f82bull);
  for (SampledPose& pose : *poses) {
    for (std::size_t c = drawn; c < controls.size(); ++c) {
      const double at = 2 * random.Unit() - 1;
      pose.values.push_back(at < 0 ? controls[c].rest
                                   : controls[c].min + (controls[c].max - controls[c].min) * at);
    }
    for (std::size_t c = 0; c < drawn; ++c) {
      if (controls[c].tilt == 0) continue;
      const double at = 2 * random.Unit() - 1, value = controls[c].rest + controls[c].tilt * (2 * at - 1);
      if (at >= 0) pose.values[c] = std::clamp(value, controls[c].lowest, controls[c].highest);
    }
  }
}

}  // namespace kpsa::engine
