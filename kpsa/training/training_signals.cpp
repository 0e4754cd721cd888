#include "kpsa/training/training_signals.h"

#include <algorithm>
#include <set>
#include <utility>

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

}  // namespace kpsa::engine
