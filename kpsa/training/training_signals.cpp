#include "kpsa/training/training_signals.h"

#include <algorithm>
#include <set>
#include <utility>

#include "kpsa/training/carried.h"
#include "kpsa/training/space_points.h"

namespace kpsa::engine {
namespace {

void AddUnknown(std::vector<Signal> found, std::vector<Signal>* known) {
  for (Signal& signal : found) {
    if (std::ranges::find(*known, signal.name, &Signal::name) == known->end())
      known->push_back(std::move(signal));
  }
}

// Nodes with a step that varies.
Result<std::set<Index>> NodesOf(const TrainingRig& rig, Compiler* compiler,
                                const std::vector<PlugRef>& outputs, const std::vector<PlugRef>& varying) {
  Request request;
  for (const PlugRef& output : outputs) request.outputs.push_back({output, {}});
  request.varying = varying;
  const auto steps = compiler->Steps(*rig.graph, request);
  if (!steps.ok()) return steps.status();
  std::set<Index> nodes;
  for (const Compiler::Stepped& stepped : *steps) nodes.insert(stepped.node.index);
  return nodes;
}

// Of the box of all points as the rig is now, in the space.
Result<double> Diagonal(const TrainingRig& rig, Compiler* compiler, const Matrix4& inverse_rest_stretch) {
  const Result<std::shared_ptr<const Plan>> plan =
      compiler->Compile(*rig.graph, SpacePointsRequest(rig.target));
  if (!plan.ok()) return plan.status();
  Evaluator evaluator(*plan);
  KPSA_RETURN_IF_ERROR(evaluator.Evaluate());
  std::vector<double> points;
  SpacePoints(evaluator, rig.target, inverse_rest_stretch, &points);
  Double3 lo, hi;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto axis = static_cast<int>(i % 3);
    lo[axis] = i < 3 ? points[i] : std::min(lo[axis], points[i]);
    hi[axis] = i < 3 ? points[i] : std::max(hi[axis], points[i]);
  }
  return Length(hi - lo);
}

}  // namespace

Result<TrainingSignals> FindTrainingSignals(const TrainingRig& rig, Compiler* compiler,
                                            const std::vector<TrainingClip>& clips, bool with_relative) {
  TrainingSignals signals;
  std::set<Index> moves_points;
  std::vector<std::vector<PlugRef>> varying_in;  // by clip
  for (int clip = -1; clip < static_cast<int>(clips.size()); ++clip) {
    KPSA_RETURN_IF_ERROR(rig.Play(clips, clip));
    std::vector<PlugRef> varying = rig.Varying(clip >= 0);
    Result<std::vector<Signal>> found =
        FindSignals(*rig.graph, compiler, rig.target.outputs(), varying, {}, nullptr);
    if (!found.ok()) return found.status();
    AddUnknown(std::move(*found), &signals.watched);
    if (!with_relative) continue;
    Result<std::set<Index>> nodes = NodesOf(rig, compiler, rig.target.outputs(), varying);
    if (!nodes.ok()) return nodes.status();
    moves_points.merge(*nodes);
    Result<std::vector<Signal>> matrices =
        FindRelativeMatrices(*rig.graph, compiler, rig.target.outputs(), varying);
    if (!matrices.ok()) return matrices.status();
    AddUnknown(std::move(*matrices), &signals.relative);
    varying_in.push_back(std::move(varying));
  }
  // A transform that moves no point tells of the space where it stands still in the world. One that moves has no range
  // that was trained, and may do anything in another clip
  for (std::size_t c = 0; c < varying_in.size(); ++c) {
    KPSA_RETURN_IF_ERROR(rig.Play(clips, static_cast<int>(c) - 1));
    std::vector<PlugRef> plugs;
    for (const Signal& signal : signals.relative) {
      if (!moves_points.contains(signal.plug.node.index)) plugs.push_back(signal.plug);
    }
    const Result<std::set<Index>> nodes = NodesOf(rig, compiler, plugs, varying_in[c]);
    if (!nodes.ok()) return nodes.status();
    std::erase_if(signals.relative, [&](const Signal& signal) {
      const Index node = signal.plug.node.index;
      return nodes->contains(node) && !moves_points.contains(node);
    });
  }
  for (std::vector<Signal>* list : {&signals.watched, &signals.relative})
    std::ranges::sort(*list, {}, &Signal::name);
  KPSA_RETURN_IF_ERROR(rig.set_clip(std::nullopt));
  return signals;
}

Result<std::vector<std::string>> MovedByClipsAlone(const TrainingRig& rig, Compiler* compiler,
                                                   const std::vector<TrainingClip>& clips,
                                                   const std::vector<Signal>& watched) {
  std::set<std::string> by_clips, by_controls;
  for (int clip = -1; clip < static_cast<int>(clips.size()); ++clip) {
    KPSA_RETURN_IF_ERROR(rig.Play(clips, clip));
    std::vector<PlugRef> varying{rig.time};
    if (clip < 0) varying = rig.Varying(false);
    for (const Signal& signal : watched) {
      std::set<std::string>& by = clip < 0 ? by_controls : by_clips;
      if (by.contains(signal.name) || (clip >= 0 && by_controls.contains(signal.name))) continue;
      const Result<std::set<Index>> nodes = NodesOf(rig, compiler, {signal.plug}, varying);
      if (!nodes.ok()) return nodes.status();
      if (!nodes->empty() || std::ranges::find(varying, signal.plug) != varying.end()) by.insert(signal.name);
    }
  }
  KPSA_RETURN_IF_ERROR(rig.set_clip(std::nullopt));
  std::vector<std::string> alone;
  for (const Signal& signal : watched) {
    if (by_clips.contains(signal.name)) alone.push_back(rig.graph->AuthoredName(signal.plug));
  }
  return alone;
}

Status LeaveOutCarried(const TrainingRig& rig, Compiler* compiler, const std::vector<TrainingClip>& clips,
                       const Matrix4& inverse_rest_stretch, double tolerance, std::vector<Signal>* relative) {
  if (rig.target.space.empty()) return Status();
  const Graph& graph = *rig.graph;
  const std::vector<NodeId> chain = ParentsFrom(graph, rig.target.space[0].node);
  // Of the chain, what is below that which carries both
  const auto between = [&](const Signal& signal) {
    const std::vector<NodeId> up = ParentsFrom(graph, signal.plug.node);
    const auto both = std::ranges::find_first_of(chain, up, {}, &NodeId::index, &NodeId::index);
    return std::span(chain.begin(), both);
  };
  if (std::ranges::all_of(*relative, [&](const Signal& signal) { return between(signal).empty(); }))
    return Status();
  KPSA_RETURN_IF_ERROR(rig.set_clip(std::nullopt));
  const Result<double> diagonal = Diagonal(rig, compiler, inverse_rest_stretch);
  if (!diagonal.ok()) return diagonal.status();
  const Result<Carried> carried =
      FindCarried(rig, compiler, clips, {}, inverse_rest_stretch, *diagonal, tolerance);
  if (!carried.ok()) return carried.status();
  std::erase_if(*relative, [&](const Signal& signal) {
    return std::ranges::any_of(between(signal), [&](NodeId node) {
      return std::ranges::find(carried->rigid, graph.name(node)) != carried->rigid.end();
    });
  });
  return Status();
}

}  // namespace kpsa::engine
