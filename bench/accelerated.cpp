// What an accelerated frame consists of: the small nodes (clips, transforms, utilities) and the points of the cues,
// up to the KPSA node's own step, and that.
//   bench_accelerated RIG SUBSPACE [passes]      20 passes over a second and a half of the rig's first test
//   clip
// Warm: frame after frame. Cold: between two frames 4 MB of something else go through the caches.
// Alternating: after the full evaluation of the same frame, as `kpsa bench` measures it; branches and code
// are cold, too. Times are sums of every frame's least over the passes, so that a busy machine shows little.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>

#include "cli/acceleration.h"
#include "host/rig_frames.h"

namespace kpsa::engine {
namespace {

using Clock = std::chrono::steady_clock;

// A run of steps of one kind.
struct Part {
  Index end = 0;
  bool points = false;
};

struct Microseconds {
  double set = 0, small = 0, points = 0, kpsa = 0;  // kpsa: its own step, and what comes after it
  double total() const { return set + small + points + kpsa; }
};

std::vector<Part> PartsBefore(const Plan& plan, Index end) {
  std::vector<Part> parts;
  for (Index s = 0; s < end; ++s) {
    const bool points = plan.infos()[s].points_total > 0;
    if (parts.empty() || parts.back().points != points) parts.push_back({s, points});
    parts.back().end = s + 1;
  }
  return parts;
}

template <typename F>
Microseconds Measure(Evaluator& evaluator, Index time, const std::vector<Part>& parts,
                     const std::vector<double>& times, int passes, F disturb) {
  std::vector<Microseconds> least(times.size(), {1e9, 1e9, 1e9, 1e9});
  const auto since = [](Clock::time_point& from) {
    const Clock::time_point now = Clock::now();
    const double us = std::chrono::duration<double, std::micro>(now - from).count();
    from = now;
    return us;
  };
  for (int pass = 0; pass < passes; ++pass) {
    for (std::size_t f = 0; f < times.size(); ++f) {
      disturb();
      Microseconds us;
      Clock::time_point from = Clock::now();
      evaluator.Set(time, times[f]);
      evaluator.BeginRun();
      us.set = since(from);
      for (const Part& part : parts) {
        evaluator.RunUntil(part.end);
        (part.points ? us.points : us.small) += since(from);
      }
      if (!evaluator.EndRun().ok()) return {};
      us.kpsa = since(from);
      if (us.total() < least[f].total()) least[f] = us;
    }
  }
  Microseconds mean;
  const auto count = static_cast<double>(times.size());
  for (const Microseconds& us : least)
    mean.set += us.set / count, mean.small += us.small / count, mean.points += us.points / count,
        mean.kpsa += us.kpsa / count;
  return mean;
}

int Report(const Rig& rig, const Plan& plan, Evaluator& evaluator, Evaluator& full, int passes) {
  const Index time = plan.FindVarying(rig.scene.time);
  Index kpsa = kNoIndex;
  for (Index s = 0; s < plan.segments()[0].end; ++s) {
    if (std::string_view(plan.step_type(s)) == "kpsa") kpsa = s;
  }
  if (time == kNoIndex || kpsa == kNoIndex) {
    fmt::print(stderr, "{}: nothing moves with time, or nothing is accelerated\n", rig.path);
    return 3;
  }
  std::vector<double> times;
  for (int f = 0; f < 36; ++f) times.push_back(f / 24.0);
  std::vector<char> other(std::size_t{4} << 20);
  const std::vector<Part> parts = PartsBefore(plan, kpsa);
  const Microseconds warm = Measure(evaluator, time, parts, times, passes, [] {});
  const Microseconds cold = Measure(evaluator, time, parts, times, passes, [&] {
    for (std::size_t i = 0; i < other.size(); i += 64) ++other[i];
  });
  const Index full_time = full.plan().FindVarying(rig.scene.time);
  std::size_t next = 0;
  bool fine = true;
  const Microseconds alternating = Measure(evaluator, time, parts, times, passes, [&] {
    full.Set(full_time, times[next++ % times.size()]);
    fine = full.Evaluate().ok() && fine;
  });
  if (!fine) return 4;
  fmt::print("{} steps before the KPSA node, {} kinds in turn; us a frame\n", kpsa, parts.size());
  for (const auto& [name, us] :
       {std::pair("warm", warm), std::pair("cold", cold), std::pair("alternating", alternating)}) {
    fmt::print(
        "  {:<11} {:6.2f} in all; set {:5.2f}, small nodes {:6.2f}, points of cues {:6.2f}, KPSA {:6.2f}\n",
        name, us.total(), us.set, us.small, us.points, us.kpsa);
  }
  return 0;
}

int Fail(const Status& status) {
  fmt::print(stderr, "{}\n", status.ToString());
  return 3;
}

int Main(int argc, char** argv) {
  if (argc < 3) {
    fmt::print(stderr, "usage: bench_accelerated RIG SUBSPACE [passes]\n");
    return 2;
  }
  Flags flags;
  flags.file = argv[1];
  AccelerationFlags acceleration;
  acceleration.kpsa = argv[2];
  acceleration.tolerance = "any";
  const Result<std::unique_ptr<OpenRig>> open = LoadRigOf(flags);
  if (!open.ok()) return Fail(open.status());
  Rig& rig = (*open)->rig;
  Compiler compiler;
  const Result<std::shared_ptr<const Plan>> full_plan = CompileFor(rig, &compiler, ShownPoints(rig));
  if (!full_plan.ok()) return Fail(full_plan.status());
  const Result<std::vector<AppliedSubspace>> applied = ApplyAcceleration(&rig, &compiler, acceleration);
  if (!applied.ok()) return Fail(applied.status());
  const Result<std::shared_ptr<const Plan>> plan = CompileFor(rig, &compiler, ShownPoints(rig));
  if (!plan.ok()) return Fail(plan.status());
  Evaluator evaluator(*plan), full(*full_plan);
  return Report(rig, **plan, evaluator, full, argc > 3 ? std::clamp(std::atoi(argv[3]), 1, 100000) : 20);
}

}  // namespace
}  // namespace kpsa::engine

int main(int argc, char** argv) { return kpsa::engine::Main(argc, argv); }
