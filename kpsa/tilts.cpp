#include "kpsa/tilts.h"

#include <algorithm>
#include <map>

#include "kpsa/random.h"
#include "kpsa/space_points.h"

namespace kpsa {
namespace {

constexpr double kTiltShare = 0.01;  // of the ranges of the axes that are controlled, together
constexpr double kMostTilt = 0.03;   // radians

}  // namespace

TrainingRig WithTilts(const TrainingRig& rig) {
  TrainingRig with = rig;
  if (rig.target.colors) return with;
  struct Turned {
    NodeId node;
    double range = 0;
    bool axes[3] = {false, false, false};
  };
  std::map<Index, Turned> turned;
  for (const ControlRange& control : rig.controls) {
    const NodeDef& def = rig.graph->def(control.plug.node);
    const int c = control.plug.component;
    if (control.plug.attribute != def.FindAttribute("rotate") || c < 0 || c > 2) continue;
    Turned& of = turned[control.plug.node.index];
    of.node = control.plug.node;
    of.range += control.max - control.min;
    of.axes[c] = true;
  }
  for (const auto& [index, of] : turned) {
    const int count = of.axes[0] + of.axes[1] + of.axes[2];
    const std::vector<PlugRef> axes = FreePlugs(*rig.graph, of.node).rotate;
    if (count != 2 || axes.empty()) continue;
    for (std::size_t c = 0; c < 3; ++c) {
      if (of.axes[c]) continue;
      const Value* set = rig.graph->FindValue(axes[c]);
      const double rest = set != nullptr && set->get_if<double>() != nullptr ? set->get<double>() : 0;
      const double tilt = std::min(kMostTilt, kTiltShare * of.range);
      with.controls.push_back({axes[c], rest - tilt, rest + tilt, rest});
    }
  }
  return with;
}

void AddTilts(const std::vector<ControlRange>& controls, std::size_t drawn, std::uint64_t seed,
              std::vector<SampledPose>* poses) {
  if (controls.size() == drawn) return;
  Random random(seed ^ 0x3c6ef372fe94f82bull);
  for (SampledPose& pose : *poses) {
    for (std::size_t c = drawn; c < controls.size(); ++c) {
      const double at = 2 * random.Unit() - 1;
      pose.values.push_back(at < 0 ? controls[c].rest
                                   : controls[c].min + (controls[c].max - controls[c].min) * at);
    }
  }
}

}  // namespace kpsa
