#include "host/profile_run.h"

#include "host/rig_frames.h"

namespace kpsa::engine {

Result<Measured> Measure(const Rig& rig, const std::shared_ptr<const Plan>& plan,
                         const std::vector<double>& times, bool parallel, const Watch& watch,
                         Profile* profile) {
  Evaluator evaluator(plan, {.parallel = parallel});
  const Index time = plan->FindVarying(rig.scene.time);
  const std::size_t frames = times.size() > 1 ? times.size() : 20;
  if (time != kNoIndex) evaluator.Set(time, times.back());
  if (const Status warm = evaluator.Evaluate(); !warm.ok()) return FailedAt(rig, times.back(), warm);
  if (!plan->stateful_node().empty()) evaluator.Restart();  // it would not go back from there
  Measured measured;
  for (std::size_t f = 0; f < frames; ++f) {
    if (watch.cancelled()) return CancelledStatus();
    evaluator.Record(profile, static_cast<int>(f));
    const double t = times[std::min(f, times.size() - 1)];
    const std::uint64_t begin = ProfileClock();
    if (time != kNoIndex) evaluator.Set(time, t);
    if (times.size() == 1) evaluator.Invalidate();
    const Status status = evaluator.Evaluate();
    measured.frames.push_back({begin, ProfileClock()});
    if (!status.ok()) return FailedAt(rig, t, status);
    measured.wall_ns += static_cast<double>(measured.frames.back().end_ns - begin);
  }
  for (Index s = 0; s < plan->steps().size(); ++s) {
    const auto ns = static_cast<double>(profile->self_ns()[s]);
    measured.node_ns += ns;
    if (plan->infos()[s].points_total == 0) measured.above_ns += ns;
  }
  return measured;
}

}  // namespace kpsa::engine
