#include "host/control_reach.h"

#include <algorithm>
#include <cmath>

#include "graph/evaluator.h"
#include "host/clip_record.h"
#include "host/rig_frames.h"
#include "host/rig_training.h"

namespace kpsa::engine {
namespace {

Value ValueFor(Type type, double number) {
  if (type == Type::kDouble) return number;
  return static_cast<std::int64_t>(std::llround(number));
}

}  // namespace

Result<std::vector<ControlReach>> ReachOfControls(const Rig& rest, const Watch& watch) {
  Request request = ShownPoints(rest);
  request.varying = VaryingPlugs(rest);
  Compiler compiler;
  const auto plan = CompileFor(rest, &compiler, request);
  if (!plan.ok()) return plan.status();
  Evaluator evaluator(*plan);
  KPSA_RETURN_IF_ERROR(evaluator.Evaluate());
  const std::size_t vertices = ShownVertices(rest);
  std::vector<float> still(3 * vertices), moved(3 * vertices);
  ReadVertices(rest, evaluator, still);
  std::vector<ControlReach> reaches(rest.controls.size());
  for (std::size_t c = 0; c < reaches.size(); ++c) {
    if (watch.cancelled()) return CancelledStatus();
    watch.Done(c, reaches.size());
    const Control& control = rest.controls[c];
    const PlugHandle handle = (*plan)->Handle(control.plug);
    if (!handle) continue;
    std::vector<float> farthest(vertices, 0);
    for (const double end : {control.min, control.max}) {
      if (!evaluator.Set(handle, ValueFor(handle.type, end)).ok() || !evaluator.Evaluate().ok()) continue;
      ReadVertices(rest, evaluator, moved);
      for (std::size_t v = 0; v < vertices; ++v) {
        const float* a = still.data() + 3 * v;
        const float* b = moved.data() + 3 * v;
        const float distance = std::hypot(b[0] - a[0], b[1] - a[1], b[2] - a[2]);
        if (std::isfinite(distance)) farthest[v] = std::max(farthest[v], distance);
      }
    }
    KPSA_RETURN_IF_ERROR(evaluator.Set(handle, ValueFor(handle.type, control.value)));
    reaches[c].largest = static_cast<double>(*std::max_element(farthest.begin(), farthest.end()));
    if (reaches[c].largest > 0) reaches[c].of_vertices = std::move(farthest);
  }
  return reaches;
}

}  // namespace kpsa::engine
