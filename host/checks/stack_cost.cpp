#include "host/checks/stack_cost.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "graph/profile.h"
#include "host/bench/side.h"
#include "host/rig_frames.h"
#include "host/rig_training.h"

namespace kpsa::engine {
namespace {

constexpr double kLittleNs = 5e3, kLittleBound = 1.5;
// What no subspace does without, on any machine: measuring, and reconstructing a point.
constexpr double kMeasuringNs = 5e3, kReconstructionNs = 2;
constexpr std::size_t kFrames = 36;
constexpr int kRuns = 3;
constexpr double kPatienceNs = 2e8;  // for one run over the frames

Result<std::shared_ptr<const Plan>> FullPlan(const Rig& rig, const AccelerateEntry& entry) {
  Request request;
  request.varying = VaryingPlugs(rig);
  for (const AcceleratedPoints& points : entry.points) request.outputs.push_back({points.points, {}});
  Compiler compiler;
  return CompileFor(rig, &compiler, request);
}

std::vector<char> StackSteps(const Plan& plan, const AccelerateEntry& entry) {
  std::vector<NodeId> nodes;
  for (const AcceleratedPoints& points : entry.points) nodes.push_back(points.points.node);
  return PointStepsAbove(plan, nodes);
}

std::size_t PointsOf(const Plan& plan) {
  std::size_t points = 0;
  for (const Plan::Output& output : plan.outputs()) points += output.points.total();
  return points;
}

FrameCost StatedCost(const Plan& plan, const AccelerateEntry& entry, const NodeRegistry& registry) {
  FrameCost cost;
  const std::vector<char> stack = StackSteps(plan, entry);
  for (Index s = 0; s < plan.steps().size(); ++s) {
    const double ns = static_cast<double>(plan.infos()[s].cost_ns);
    cost.frame += ns;
    if (stack[s]) cost.stack += ns;
  }
  const ComputeGroup& kpsa = registry.Find("kpsa")->groups.front();
  cost.least = static_cast<double>(kpsa.cost_ns) +
               static_cast<double>(kpsa.cost_ns_per_point) * static_cast<double>(PointsOf(plan));
  return cost;
}

// Everything is evaluated in every frame, as where all controls move.
Status Time(const RigOpener& opener, const AccelerateEntry& entry, const std::vector<TrainingClip>& clips,
            const Watch& watch, StackCost* cost) {
  const Result<std::unique_ptr<OpenRig>> open = opener.open({});
  if (!open.ok()) return open.status();
  Rig& rig = (*open)->rig;
  std::vector<double> times(kFrames, 0.0);
  if (!clips.empty() && !clips.front().times.empty()) {
    KPSA_RETURN_IF_ERROR(SetClip(&rig, clips.front().name));
    const std::vector<double>& frames = clips.front().times;
    for (std::size_t f = 0; f < kFrames; ++f) times[f] = frames[f * (frames.size() - 1) / (kFrames - 1)];
  }
  const Result<std::shared_ptr<const Plan>> plan = FullPlan(rig, entry);
  if (!plan.ok()) return plan.status();
  Side side(rig, *plan, {.frames = kFrames, .still = true, .cancel = watch.cancel});
  const std::uint64_t begin = ProfileClock();
  KPSA_RETURN_IF_ERROR(side.Evaluate(times[0]));
  const double first = static_cast<double>(ProfileClock() - begin);
  times.resize(
      std::clamp<std::size_t>(static_cast<std::size_t>(kPatienceNs / std::max(1.0, first)), 1, kFrames));
  side.times = FrameTimes(times.size(), true);
  for (int run = 0; run < kRuns; ++run) {
    side.StartAgain();
    KPSA_RETURN_IF_ERROR(side.Turn(times, 0, times.size()));
  }
  std::vector<double> frames;
  for (const std::vector<double>& runs : side.times.Finish()) frames.push_back(Median(runs));
  side.StartAgain();
  RecordedSteps recorded;
  KPSA_RETURN_IF_ERROR(side.RecordTurn(times, 0, times.size(), &recorded));

  cost->timed.frame = Median(frames);
  cost->timed.least = kMeasuringNs + kReconstructionNs * static_cast<double>(cost->points);
  // Recording takes time of its own: what it tells are shares
  const double all = std::max(
      {1.0, recorded.wall_ns, std::accumulate(recorded.self_ns.begin(), recorded.self_ns.end(), 0.0)});
  const std::vector<char> stack = StackSteps(**plan, entry);
  std::map<std::string, double> deformers;
  for (Index s = 0; s < (*plan)->steps().size(); ++s) {
    const double ns = cost->timed.frame * recorded.self_ns[s] / all;
    if (!stack[s]) continue;
    cost->timed.stack += ns;
    deformers[(*plan)->step_name(s)] += ns;
  }
  cost->deformers.assign(deformers.begin(), deformers.end());
  std::stable_sort(cost->deformers.begin(), cost->deformers.end(),
                   [](const auto& a, const auto& b) { return a.second > b.second; });
  return Status();
}

}  // namespace

double FrameCost::saving() const { return std::max(0.0, stack - least); }
double FrameCost::bound() const { return frame > saving() ? frame / (frame - saving()) : 1; }
bool FrameCost::little() const { return saving() < kLittleNs || bound() < kLittleBound; }

Result<StackCost> MeasureStack(const OpenRig& open, const RigOpener& opener, const AccelerateEntry& entry,
                               const std::vector<TrainingClip>& clips, const Watch& watch) {
  const Result<std::shared_ptr<const Plan>> plan = FullPlan(open.rig, entry);
  if (!plan.ok()) return plan.status();
  StackCost cost;
  cost.points = PointsOf(**plan);
  cost.stated = StatedCost(**plan, entry, open.registry);
  if (cost.stated.little()) KPSA_RETURN_IF_ERROR(Time(opener, entry, clips, watch, &cost));
  return cost;
}

}  // namespace kpsa::engine
