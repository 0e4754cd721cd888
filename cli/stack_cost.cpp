#include "cli/stack_cost.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>

#include "cli/bench_side.h"
#include "cli/rig_frames.h"
#include "graph/profile.h"
#include "host/rig_training.h"

namespace kpsa::engine {
namespace {

constexpr double kLittleNs = 20e3, kLittleBound = 1.5;
// What no subspace does without, on any machine: measuring, and reconstructing a point.
constexpr double kMeasuringNs = 5e3, kReconstructionNs = 2;
constexpr std::size_t kFrames = 36;
constexpr int kRuns = 3;
constexpr double kPatienceNs = 2e8;  // for one run over the frames

Result<std::shared_ptr<const Plan>> FullPlan(const Rig& rig, const Acceleration& entry) {
  Request request;
  request.varying = VaryingPlugs(rig);
  for (const AcceleratedPoints& points : entry.points) request.outputs.push_back({points.points, {}});
  Compiler compiler;
  return CompileFor(rig, &compiler, request);
}

std::vector<char> StackSteps(const Plan& plan, const Acceleration& entry) {
  std::vector<NodeId> nodes;
  for (const AcceleratedPoints& points : entry.points) nodes.push_back(points.points.node);
  return PointStepsAbove(plan, nodes);
}

std::size_t PointsOf(const Plan& plan) {
  std::size_t points = 0;
  for (const Plan::Output& output : plan.outputs()) points += output.points.total();
  return points;
}

FrameCost StatedCost(const Plan& plan, const Acceleration& entry, const NodeRegistry& registry) {
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
Status Time(const Flags& flags, const Acceleration& entry, const std::vector<TrainingClip>& clips,
            StackCost* cost) {
  const Result<std::unique_ptr<OpenRig>> open = LoadRigOf(flags);
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
  Side side(rig, *plan, false, kFrames, true);
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

std::string Microseconds(double ns) { return fmt::format("{:.{}f} us", ns / 1e3, ns < 9950 ? 1 : 0); }

nlohmann::ordered_json CostJson(const FrameCost& cost) {
  return {{"frame_ms", cost.frame / 1e6},
          {"stack_ms", cost.stack / 1e6},
          {"least_ms", cost.least / 1e6},
          {"saving_ms", cost.saving() / 1e6},
          {"speedup_at_most", cost.bound()}};
}

}  // namespace

double FrameCost::saving() const { return std::max(0.0, stack - least); }
double FrameCost::bound() const { return frame > saving() ? frame / (frame - saving()) : 1; }
bool FrameCost::little() const { return saving() < kLittleNs || bound() < kLittleBound; }

Result<StackCost> MeasureStack(const OpenRig& open, const Flags& flags, const Acceleration& entry,
                               const std::vector<TrainingClip>& clips) {
  const Result<std::shared_ptr<const Plan>> plan = FullPlan(open.rig, entry);
  if (!plan.ok()) return plan.status();
  StackCost cost;
  cost.points = PointsOf(**plan);
  cost.stated = StatedCost(**plan, entry, open.registry);
  if (cost.stated.little()) KPSA_RETURN_IF_ERROR(Time(flags, entry, clips, &cost));
  return cost;
}

std::string NotWorthItText(const StackCost& cost, const std::string& rig) {
  constexpr std::size_t kNamed = 4;
  const FrameCost& timed = cost.timed;
  std::string text =
      fmt::format("{}: a frame of this stack costs {}, {} could be saved: not worth it\nof which ", rig,
                  Microseconds(timed.frame), Microseconds(timed.saving()));
  double named = 0;
  for (std::size_t d = 0; d < std::min(kNamed, cost.deformers.size()); ++d) {
    text += fmt::format("{} {}, ", cost.deformers[d].first, Microseconds(cost.deformers[d].second));
    named += cost.deformers[d].second;
  }
  if (cost.deformers.size() > kNamed)
    text += fmt::format("other deformers {}, ", Microseconds(timed.stack - named));
  return text + fmt::format(
                    "graph {}; to measure cues and reconstruct {} takes {} at least\n"
                    "nothing was trained; --force trains it all the same\n",
                    Microseconds(timed.frame - timed.stack), Plural(cost.points, "point"),
                    Microseconds(timed.least));
}

std::string NotWorthItJson(const StackCost& cost) {
  nlohmann::ordered_json deformers = nlohmann::ordered_json::array();
  for (const auto& [name, ns] : cost.deformers)
    deformers.push_back({{"name", name}, {"ms_per_frame", ns / 1e6}});
  const nlohmann::ordered_json document = {{"schema", "kpsa.train/1"},
                                           {"subspace", nullptr},
                                           {"not_worth_it",
                                            {{"points", cost.points},
                                             {"timed", CostJson(cost.timed)},
                                             {"stated", CostJson(cost.stated)},
                                             {"deformers", std::move(deformers)}}}};
  return document.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace kpsa::engine
