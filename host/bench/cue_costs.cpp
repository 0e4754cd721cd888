#include "host/bench/cue_costs.h"

#include <algorithm>

#include "kpsa/kpsa_node.h"

namespace kpsa::engine {
namespace {

using CueRow = KpsaConfig::Row;

// The same node may put points together as well as deform them.
std::string StepKey(const Plan& plan, Index step) {
  return std::string(plan.step_name(step)) + '/' + plan.step_label(step);
}

double NumbersOf(const KpsaConfig::Data& data, const CueRow& row) {
  if (row.kind == CueRow::Kind::kPoint) return 3;
  if (row.kind != CueRow::Kind::kProduct) return 1;
  return data.products[row.input].b.kind == CueRow::Kind::kPoint ? 1 : 2;
}

// Points of the mesh, or shading points, on which a cue lies.
Index PointsInAll(const Rig& rig, const AppliedSubspace& one, std::size_t cue) {
  const std::size_t output = one.subspace->cues[cue].mesh;
  const AcceleratedPoints& points = one.entry.points[output];
  return points.colors ? static_cast<Index>(one.subspace->outputs[output].points)
                       : rig.scene.meshes[points.mesh].mesh().point_count();
}

// What the cues of one input make each step compute, by themselves; of a plan that does not compile, nothing.
std::map<std::string, double> PointsFor(const Rig& rig, const AppliedSubspace& one, Index input, Index total,
                                        Compiler* compiler) {
  std::map<std::string, double> points;
  const std::vector<Index>& wanted = one.config->data().cues[input].points;
  if (wanted.empty() || wanted.back() >= total) return points;
  const int attribute = rig.graph->def(one.node).FindAttribute("cues");
  for (const Connection& connection : rig.graph->Inputs(one.node, attribute)) {
    if (connection.destination.element != static_cast<int>(input)) continue;
    const auto plan =
        compiler->Compile(*rig.graph, {{{connection.source, PointSet::Of(wanted, total)}}, {rig.scene.time}});
    if (!plan.ok()) continue;
    for (Index s = 0; s < (*plan)->steps().size(); ++s)
      points[StepKey(**plan, s)] += static_cast<double>((*plan)->infos()[s].points);
  }
  return points;
}

}  // namespace

void CueCosts::Load(const Rig& rig, const Plan& plan, const std::vector<AppliedSubspace>& applied,
                    Compiler* compiler) {
  stages_.clear(), steps_.clear(), numbers_.clear();
  ns_.resize(applied.size());
  std::vector<NodeId> nodes;
  for (std::size_t a = 0; a < applied.size(); ++a) {
    const KpsaConfig::Data& data = applied[a].config->data();
    nodes.push_back(applied[a].node);
    ns_[a].resize(applied[a].subspace->cues.size());
    numbers_.emplace_back();
    std::map<Index, Stage> by_input;
    for (std::size_t r = 0; r < data.rows.size(); ++r) {
      numbers_[a].push_back(NumbersOf(data, data.rows[r]));
      if (data.rows[r].kind == CueRow::Kind::kPoint) by_input[data.rows[r].input].cues.push_back(r);
    }
    for (auto& [input, stage] : by_input) {
      stage.subspace = a;
      stage.points =
          PointsFor(rig, applied[a], input, PointsInAll(rig, applied[a], stage.cues.front()), compiler);
      stages_.push_back(std::move(stage));
    }
  }
  const std::vector<char> above = PointStepsAbove(plan, nodes);
  for (Index s = 0; s < plan.steps().size(); ++s) {
    const Plan::StepInfo& info = plan.infos()[s];
    if (!above[s] || info.segment != 0 || std::ranges::find(nodes, info.node) != nodes.end()) continue;
    Step step{s, StepKey(plan, s)};
    for (const Stage& stage : stages_) {
      if (const auto at = stage.points.find(step.name); at != stage.points.end()) step.points += at->second;
    }
    steps_.push_back(std::move(step));
  }
}

void CueCosts::Add(const RecordedSteps& recorded, double scale) {
  const auto share = [&](const Stage& stage, double ns) {
    for (const std::size_t cue : stage.cues)
      ns_[stage.subspace][cue] += ns / static_cast<double>(stage.cues.size());
  };
  std::size_t cues = 0;
  for (const Stage& stage : stages_) cues += stage.cues.size();
  for (const Step& step : steps_) {
    const double ns = recorded.self_ns[step.index] * scale;
    for (const Stage& stage : stages_) {
      const auto at = stage.points.find(step.name);
      // What puts points together for the node alone is there for all of them
      if (step.points > 0)
        share(stage, at == stage.points.end() ? 0 : ns * at->second / step.points);
      else
        share(stage, ns * static_cast<double>(stage.cues.size()) / static_cast<double>(cues));
    }
  }
  double numbers = 0;  // of all cues
  for (const std::vector<double>& subspace : numbers_) {
    for (const double n : subspace) numbers += n;
  }
  for (std::size_t a = 0; a < numbers_.size(); ++a) {
    for (std::size_t c = 0; c < numbers_[a].size(); ++c)
      ns_[a][c] += static_cast<double>(recorded.kpsa.cues) * scale * numbers_[a][c] / numbers;
  }
}

std::vector<std::vector<double>> CueCosts::Finish(double frames) const {
  std::vector<std::vector<double>> us = ns_;
  for (std::vector<double>& subspace : us) {
    for (double& cue : subspace) cue /= 1e3 * frames;
  }
  return us;
}

}  // namespace kpsa::engine
