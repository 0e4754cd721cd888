// What the times of a contender's clips say of it.
#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <string_view>

#include "host/bench/contender.h"

namespace kpsa::engine {
namespace {

// The least and the most of the runs, and of what is told of all of them.
BenchResult::Range RangeOf(const std::vector<double>& runs, double factor, double told) {
  BenchResult::Range range{told, told};
  for (double run : runs)
    range.least = std::min(range.least, run * factor), range.most = std::max(range.most, run * factor);
  return range;
}

void AddNode(const Plan& plan, Index step, double ns, std::map<std::string, BenchNode>* nodes) {
  BenchNode& node = (*nodes)[plan.step_name(step)];
  node.name = plan.step_name(step), node.type = plan.step_type(step);
  node.ms_per_frame += ns;
  node.points = std::max(node.points, plan.infos()[step].points);
}

// Sums in nanoseconds as means in milliseconds.
std::vector<BenchNode> NodesOf(const std::map<std::string, BenchNode>& sums, double frames) {
  std::vector<BenchNode> nodes;
  for (const auto& [name, node] : sums) {
    nodes.push_back(node);
    nodes.back().ms_per_frame /= frames * 1e6;
  }
  std::stable_sort(nodes.begin(), nodes.end(),
                   [](const BenchNode& a, const BenchNode& b) { return a.ms_per_frame > b.ms_per_frame; });
  return nodes;
}

// What is odd about the times.
void NoteTimes(BenchResult* result) {
  constexpr double kOdd = 1.1, kExceeds = 1.02;
  if (result->wall_over_cpu > kOdd) {
    result->notes.push_back(
        fmt::format("the clock ran {:.3g} times as long as the program worked (something else runs, too): "
                    "times are those of its work",
                    result->wall_over_cpu));
  }
  if (result->parts_ms > kExceeds * result->accelerated_ms) {
    result->notes.push_back(fmt::format(
        "parts sum to {:.3f} ms of {:.3f} ms: recording costs {:.0f} %; they are shown as shares of the "
        "total",
        result->parts_ms, result->accelerated_ms, 100 * (result->parts_ms / result->accelerated_ms - 1)));
  }
}

}  // namespace

std::vector<int> Contender::KindsOfFrames(std::size_t frames) const {
  std::vector<int> kinds;
  for (std::size_t f = result.per_frame.size() - frames; f < result.per_frame.size(); ++f)
    kinds.push_back(static_cast<int>(result.per_frame[f].decision.verdict()));
  return kinds;
}

void Contender::AddTimes(const FrameTimes& full) {
  const auto add_runs = [](const std::vector<std::vector<double>>& frames, std::vector<double>* runs) {
    for (const std::vector<double>& frame : frames) {
      runs->resize(std::max(runs->size(), frame.size()));
      for (std::size_t run = 0; run < frame.size(); ++run) (*runs)[run] += frame[run];
    }
  };
  add_runs(full.ns(), &sums.full_run_ns);
  add_runs(side->times.ns(), &sums.accelerated_run_ns);
  sums.full_wall += full.wall_ns(), sums.full_cpu += full.cpu_ns();
  sums.wall += side->times.wall_ns(), sums.cpu += side->times.cpu_ns();
  const std::size_t frames = full.ns().size();
  for (std::size_t f = 0; f < frames; ++f) {
    const double a = Median(full.ns()[f]), b = Median(side->times.ns()[f]);
    sums.full_ns += a, sums.accelerated_ns += b;
    BenchResult::Frame& frame = result.per_frame[result.per_frame.size() - frames + f];
    frame.full_ms = a / 1e6, frame.accelerated_ms = b / 1e6;
    if (frame.decision.hit()) sums.full_hit_ns += a, sums.accelerated_hit_ns += b;
  }
}

// A profiled evaluation is slower: its parts are scaled to the timed one. Rigs of one file have the same
// nodes, so this side's name steps of the full plan, too.
void Contender::AddFullProfile(const Plan& plan, const RecordedSteps& recorded, double full_ns) {
  const double scale =
      full_ns / std::max({1.0, recorded.wall_ns,
                          std::accumulate(recorded.self_ns.begin(), recorded.self_ns.end(), 0.0)});
  std::vector<NodeId> stage_nodes;
  for (const AppliedSubspace& one : applied) {
    for (const AcceleratedPoints& points : one.entry.points) {
      stage_nodes.push_back(points.points.node);
      if (points.colors) continue;
      // Stages that are left out of the plan leave it to those before them
      const std::vector<Stage>& stages = open->rig.scene.meshes[points.mesh].stages;
      for (std::size_t s = 0; s < points.stage; ++s) stage_nodes.push_back(stages[s].node);
    }
  }
  const std::vector<char> skippable = PointStepsAbove(plan, stage_nodes);
  std::set<std::string_view> kept;  // steps of this side that run in every frame
  for (Index s = 0; s < side->plan->steps().size(); ++s) {
    if (side->plan->infos()[s].segment == 0) kept.insert(side->plan->step_name(s));
  }
  double graph = 0, points = 0, steps_ns = 0, kept_steps = 0;
  for (Index s = 0; s < plan.steps().size(); ++s) {
    const double ns = recorded.self_ns[s] * scale;
    AddNode(plan, s, ns, &sums.nodes);
    steps_ns += ns;
    if (skippable[s] || !kept.contains(plan.step_name(s))) continue;
    (plan.infos()[s].points_total > 0 ? points : graph) += ns;
    ++kept_steps;
  }
  // What passes between steps is theirs in equal parts
  const double between = std::max(0.0, full_ns - steps_ns);
  sums.bound_points += points;
  sums.bound_graph +=
      graph + between * kept_steps / static_cast<double>(std::max<std::size_t>(1, plan.steps().size()));
  sums.points_full += PointsComputed(plan, recorded);
}

void Contender::AddProfile(const RecordedSteps& recorded, double fast_ns) {
  const Plan& plan = *side->plan;
  std::vector<NodeId> kpsa_nodes;
  for (const AppliedSubspace& one : applied) kpsa_nodes.push_back(one.node);
  const std::vector<char> cue_steps = PointStepsAbove(plan, kpsa_nodes);
  double cues = static_cast<double>(recorded.kpsa.cues), downstream = 0, misses = 0;
  for (Index s = 0; s < plan.steps().size(); ++s) {
    const Plan::StepInfo& info = plan.infos()[s];
    if (recorded.counts[s] > 0) sums.computed.insert(plan.step_name(s));
    if (std::find(kpsa_nodes.begin(), kpsa_nodes.end(), info.node) != kpsa_nodes.end()) continue;
    if (info.segment != 0) {
      misses += recorded.self_ns[s];
    } else if (info.points_total > 0) {
      (cue_steps[s] ? cues : downstream) += recorded.self_ns[s];
    }
  }
  const auto projection = static_cast<double>(recorded.kpsa.projection),
             reconstruction = static_cast<double>(recorded.kpsa.reconstruction);
  // The graph is what the other parts leave; where these are more than all of it, as recording them costs
  // time, they share it as they are
  const double parts = cues + projection + reconstruction + downstream + misses,
               all = std::max({1.0, recorded.wall_ns, parts}), scale = fast_ns / all;
  sums.parts += fast_ns * all / std::max(1.0, recorded.wall_ns);
  sums.cues += cues * scale, sums.downstream += downstream * scale, sums.misses += misses * scale;
  sums.projection += projection * scale, sums.reconstruction += reconstruction * scale;
  sums.graph += (all - parts) * scale;
  cue_costs.Add(recorded, scale);
  for (Index s = 0; s < plan.steps().size(); ++s) {
    if (std::ranges::find(kpsa_nodes, plan.infos()[s].node) == kpsa_nodes.end() && recorded.counts[s] > 0)
      AddNode(plan, s, recorded.self_ns[s] * scale, &sums.accelerated_nodes);
  }
  // What the parts of KPSA nodes take is known of all of them together
  const double own = static_cast<double>(recorded.kpsa.cues) + projection + reconstruction;
  for (const AppliedSubspace& one : applied) {
    BenchNode& node = sums.accelerated_nodes[open->rig.graph->name(one.node)];
    node.name = open->rig.graph->name(one.node), node.type = open->rig.graph->def(one.node).name;
    node.ms_per_frame += own * scale / static_cast<double>(applied.size());
    node.points = static_cast<Index>(result.points);
  }
  sums.points_accelerated += PointsComputed(plan, recorded);
}

void Contender::Finish(double wanted_speedup) {
  const auto frames = static_cast<double>(std::max<std::size_t>(1, result.frames));
  const auto hits = static_cast<double>(std::max<std::size_t>(1, result.hits));
  const auto ms = [&](double ns) { return ns / frames / 1e6; };
  result.full_ms = ms(sums.full_ns);
  result.accelerated_ms = ms(sums.accelerated_ns);
  result.full_ms_on_hits = sums.full_hit_ns / hits / 1e6;
  result.accelerated_ms_on_hits = sums.accelerated_hit_ns / hits / 1e6;
  result.graph_ms = ms(sums.graph), result.cues_ms = ms(sums.cues),
  result.projection_ms = ms(sums.projection);
  result.reconstruction_ms = ms(sums.reconstruction), result.downstream_ms = ms(sums.downstream),
  result.misses_ms = ms(sums.misses);
  result.cue_us = cue_costs.Finish(frames);
  // What is left without cues and reconstruction: as measured, where no miss is among it; else as in the full
  // evaluation, whose points leave colder caches behind
  const bool all_hit = result.hits == result.frames;
  result.bound_graph_ms = all_hit ? result.graph_ms : ms(sums.bound_graph);
  result.bound_points_ms = all_hit ? result.downstream_ms : ms(sums.bound_points);
  result.bound_ms = result.bound_graph_ms + result.bound_points_ms;
  result.points_full = sums.points_full / frames;
  result.points_accelerated = sums.points_accelerated / frames;
  result.full_nodes = NodesOf(sums.nodes, frames);
  result.accelerated_nodes = NodesOf(sums.accelerated_nodes, frames);
  for (const auto& [name, node] : sums.nodes) {
    if (!sums.computed.contains(name)) result.never_evaluated.push_back(name);
  }
  result.nodes_total = sums.nodes.size();
  result.parts_ms = ms(sums.parts);
  std::vector<double> ratios;
  for (std::size_t run = 0; run < sums.full_run_ns.size(); ++run)
    ratios.push_back(Ratio(sums.full_run_ns[run], sums.accelerated_run_ns[run]));
  result.full_range = RangeOf(sums.full_run_ns, 1 / frames / 1e6, result.full_ms);
  result.accelerated_range = RangeOf(sums.accelerated_run_ns, 1 / frames / 1e6, result.accelerated_ms);
  result.speedup_range = RangeOf(ratios, 1, result.speedup());
  if (sums.full_cpu > 0 && sums.cpu > 0) {
    result.cpu_times = true;
    result.wall_over_cpu = std::max(sums.full_wall / sums.full_cpu, sums.wall / sums.cpu);
  }
  NoteTimes(&result);
  result.most_frequent_reason = reasons.MostFrequent();
  result.error_rms = errors.rms();
  result.error_p99 = errors.Percentile(0.99);
  result.motion_rms = errors.motion_rms();
  result.diagonal = errors.diagonal();
  result.tolerances =
      tolerances.Table(result.full_ms, result.accelerated_ms_on_hits, result.accelerated_ms, wanted_speedup);
}

}  // namespace kpsa::engine
