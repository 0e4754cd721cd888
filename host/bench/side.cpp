#include "host/bench/side.h"

#include <algorithm>

#include "graph/plan_report.h"
#include "host/rig_frames.h"

namespace kpsa::engine {
namespace {

constexpr int kMostRepeats = 3;                   // of a frame that is interrupted while it is recorded
constexpr double kWaitShare = 0.1, kWait = 20e3;  // that is: it waits for so much of its time, and ns

// What it costs to record the steps of a profile: for small nodes as much as they do.
double RecordingNs(const Plan& plan, const RecordedSteps& recorded) {
  constexpr int kEvents = 4000;
  if (plan.steps().empty()) return 0;
  Profile profile(plan);
  const std::uint64_t begin = ProfileClock();
  for (int i = 0; i < kEvents; ++i) profile.Add({0, kNoIndex, ProfileClock(), ProfileClock(), 0, 0});
  const double each = static_cast<double>(ProfileClock() - begin) / kEvents;
  double events = 0;
  for (std::uint64_t count : recorded.counts) events += static_cast<double>(count);
  return each * events;
}

}  // namespace

// Steps with points that the outputs of these nodes need, themselves included.
std::vector<char> PointStepsAbove(const Plan& plan, const std::vector<NodeId>& nodes) {
  const auto count = static_cast<Index>(plan.steps().size());
  std::vector<char> seen(count, 0);
  std::vector<Index> stack;
  for (Index s = 0; s < count; ++s) {
    if (std::find(nodes.begin(), nodes.end(), plan.infos()[s].node) != nodes.end())
      stack.push_back(s), seen[s] = 1;
  }
  while (!stack.empty()) {
    const Index s = stack.back();
    stack.pop_back();
    for (Index p : Producers(plan, s)) {
      if (!seen[p]) stack.push_back(p), seen[p] = 1;
    }
  }
  for (Index s = 0; s < count; ++s) seen[s] = seen[s] && plan.infos()[s].points_total > 0;
  return seen;
}

double PointsComputed(const Plan& plan, const RecordedSteps& recorded) {
  double points = 0;
  for (Index s = 0; s < plan.steps().size(); ++s) {
    if (*plan.step_label(s) != 0 || std::string_view(plan.step_type(s)) == "kpsa") continue;
    points += static_cast<double>(plan.infos()[s].points) * static_cast<double>(recorded.counts[s]);
  }
  return points;
}

Side::Side(const Rig& of, std::shared_ptr<const Plan> made, const SideOptions& options)
    : rig(of),
      plan(std::move(made)),
      evaluator(std::make_unique<Evaluator>(plan, EvaluatorOptions{options.parallel, nullptr})),
      time(plan->FindVarying(of.scene.time)),
      times(options.frames, !options.parallel),
      anew(options.still || options.frames == 1),
      one_thread(!options.parallel),
      watch{{}, options.cancel} {}

Status Side::Evaluate(double t) {
  if (time != kNoIndex) evaluator->Set(time, t);
  const Status status = evaluator->Evaluate();
  if (status.ok()) return status;
  return FailedAt(rig, t, status);
}

Status Side::Turn(const std::vector<double>& at, std::size_t first, std::size_t end) {
  times.BeginTurn(first);
  Status status;
  for (std::size_t f = first; f < end && status.ok(); ++f) {
    if (watch.cancelled()) return CancelledStatus();
    Forget();
    const std::uint64_t begin = ProfileClock();
    status = Evaluate(at[f]);
    times.Add(ProfileClock() - begin);
  }
  times.EndTurn();
  return status;
}

Status Side::RecordTurn(const std::vector<double>& at, std::size_t first, std::size_t end,
                        RecordedSteps* recorded) {
  recorded->self_ns.resize(plan->steps().size());
  recorded->counts.resize(plan->steps().size());
  Profile profile(*plan);
  RecordedSteps turn;
  turn.counts.resize(plan->steps().size());
  for (std::size_t f = first; f < end; ++f) {
    double wall = 0;
    for (int attempt = 0;; ++attempt) {
      if (watch.cancelled()) return CancelledStatus();
      Forget();
      profile.Clear();
      const std::uint64_t begin_cpu = ThreadCpuClock();
      evaluator->Record(&profile, static_cast<int>(f));
      const std::uint64_t begin = ProfileClock();
      Status status = Evaluate(at[f]);
      wall = static_cast<double>(ProfileClock() - begin);
      evaluator->Record(nullptr);
      const auto cpu = static_cast<double>(ThreadCpuClock() - begin_cpu);
      KPSA_RETURN_IF_ERROR(std::move(status));
      const bool waited = one_thread && wall - cpu > kWait && wall - cpu > kWaitShare * wall;
      if (!waited || attempt == kMostRepeats || !plan->stateful_node().empty() || (f == 0 && !anew)) break;
      if (!anew) KPSA_RETURN_IF_ERROR(Evaluate(at[f - 1]));
    }
    const KpsaTimes taken = KpsaTimesOf(*plan, profile);
    recorded->kpsa.cues += taken.cues, recorded->kpsa.projection += taken.projection;
    recorded->kpsa.reconstruction += taken.reconstruction;
    turn.wall_ns += wall;
    for (std::size_t s = 0; s < turn.counts.size(); ++s) {
      recorded->self_ns[s] += static_cast<double>(profile.self_ns()[s]);
      recorded->counts[s] += profile.counts()[s];
      turn.counts[s] += profile.counts()[s];
    }
  }
  recorded->wall_ns += turn.wall_ns - RecordingNs(*plan, turn);
  return Status();
}

}  // namespace kpsa::engine
