#include "kpsa/accelerate.h"

#include <algorithm>
#include <functional>
#include <map>
#include <set>

#include "base/check.h"
#include "kpsa/signature.h"
#include "kpsa/training_record.h"

namespace kpsa {
namespace {

// A signal by its name, as the subspace stores it ("jaw.matrix", or a scalar).
struct Guards {
  std::vector<Signal> matrices, scalars;
};

// Position of a signal in a list, added if it is not there.
Index Place(std::vector<Signal>* list, const Signal& signal) {
  for (Index i = 0; i < list->size(); ++i) {
    if ((*list)[i].name == signal.name) return i;
  }
  list->push_back(signal);
  return static_cast<Index>(list->size() - 1);
}

Result<Signal> FindSignal(const Graph& graph, const std::string& name, const RigWithin& within) {
  Result<PlugRef> plug = graph.FindPlug(within.prefix + name);
  if (!plug.ok() && !within.prefix.empty()) plug = graph.FindPlug(name);  // time
  if (!plug.ok()) return plug.status();
  Signal signal{graph.PlugName(*plug), *plug, graph.PlugType(*plug) == Type::kMatrix};
  return signal;
}

// The value of a signal at rest, by entries.
Status RestEntries(const Graph& graph, Compiler* compiler, const Signal& signal, double entries[12]) {
  Result<Value> rest = compiler->Rest(graph, signal.plug);
  if (!rest.ok()) return rest.status();
  if (signal.matrix) {
    MatrixEntries(rest->get<Matrix4>(), entries);
  } else {
    entries[0] = rest->AsDouble();
  }
  return Status();
}

// What may vary, and what is set here without varying: guards look at both. What is set and was never moved
// in training has no range that says how far it may go, and is a miss whatever its value.
std::vector<PlugRef> GuardedPlugs(const Graph& graph, const AccelerationTarget& target,
                                  const TrainingRecord& record,
                                  const std::map<std::string, TrainedRange>& ranges,
                                  const std::vector<SetHere>& set_here,
                                  const std::function<void(const std::string&)>& always_miss) {
  const std::set<std::string> controls(record.controls.begin(), record.controls.end());
  std::vector<PlugRef> guarded = target.varying;
  std::vector<std::string> untrained;
  for (const SetHere& set : set_here) {
    if (set.structural) continue;
    const std::string name = target.within.Inner(graph.PlugName(set.plug));
    if (set.carries || controls.count(name) != 0 || ranges.count(name) != 0) {
      guarded.push_back(set.plug);
    } else {
      untrained.push_back(fmt::format("{} = {}", set.name, set.value));
    }
  }
  if (untrained.size() == 1) {
    always_miss(untrained[0] + " is set, and the subspace never saw it move");
  } else if (!untrained.empty()) {
    always_miss(fmt::format("{} and {} more are set, and the subspace never saw them move", untrained[0],
                            untrained.size() - 1));
  }
  return guarded;
}

}  // namespace

std::vector<PlugRef> AccelerationTarget::outputs() const {
  std::vector<PlugRef> plugs;
  for (const MeshPoints& mesh : meshes) plugs.push_back(mesh.stages.back().points);
  return plugs;
}

Result<Accelerated> Accelerate(Graph* graph, Compiler* compiler, const AccelerationTarget& target,
                               std::shared_ptr<const Subspace> subspace, const std::string& node_name,
                               const AccelerateOptions& options) {
  Accelerated result;
  const RigWithin& within = target.within;
  KpsaConfig::Data data;
  data.subspace = subspace;

  // The same rig as in training?
  if (subspace->outputs.size() != target.meshes.size()) {
    return Status::Invalid("the subspace is for {} meshes, the rig accelerates {}", subspace->outputs.size(),
                           target.meshes.size());
  }
  for (std::size_t m = 0; m < target.meshes.size(); ++m) {
    if (subspace->outputs[m].name != target.meshes[m].name) {
      return Status::Invalid("the subspace is for {}, the rig accelerates {}", subspace->outputs[m].name,
                             target.meshes[m].name);
    }
  }
  const TrainingRecord record = ParseTraining(subspace->training);
  if (SignatureDigest(record.signature) != subspace->rig_hash)
    return Status::Invalid("the subspace is corrupt: its rig hash is not that of the rig that it describes");
  const auto always_miss = [&](const std::string& reason) {
    if (!data.always_miss) data.always_miss_reason = reason;
    data.always_miss = true;
    result.notes.push_back(reason + ": every frame is evaluated fully");
  };
  Signature now = RigSignature(*graph, target.outputs(), target.space, target.controls, within);
  const std::vector<SetHere> set_here =
      TakeSetHere(*graph, target.outputs(), target.space, target.controls, within, record.signature, &now);
  if (const std::string difference = SignatureDifference(record.signature, now); !difference.empty()) {
    if (!options.stale_is_miss) {
      return Status::Invalid(
          "the subspace is stale: since it was trained, {} changed; train it again, or use --stale miss",
          difference);
    }
    always_miss(fmt::format("the subspace is stale ({} changed)", difference));
  }
  for (const SetHere& set : set_here) {
    if (!set.structural) continue;
    if (!options.stale_is_miss) {
      return Status::Invalid(
          "{} is set to {} here, the subspace was trained on what the rig says; evaluate without "
          "--accelerate, or train a rig that says so",
          set.name, set.value);
    }
    always_miss(fmt::format("{} is set to {} here, and the subspace was trained on what the rig says",
                            set.name, set.value));
  }
  if (subspace->space != target.space_name) {
    return Status::Invalid("the subspace lives in space \"{}\", the rig asks for \"{}\"", subspace->space,
                           target.space_name);
  }

  // Guards: what was trained, with its range, and what moves here although it never moved there, at its rest
  // value
  std::map<std::string, TrainedRange> ranges;
  for (const TrainedRange& range : subspace->ranges) ranges.emplace(range.plug, range);
  const std::vector<PlugRef> varying = GuardedPlugs(*graph, target, record, ranges, set_here, always_miss);
  std::vector<std::string> unguarded;
  Result<std::vector<Signal>> signals =
      FindSignals(*graph, compiler, target.outputs(), varying,
                  target.space.empty() ? nullptr : &target.space[0], &unguarded);
  if (!signals.ok()) return signals.status();
  if (!unguarded.empty()) always_miss(unguarded[0] + " varies and cannot be guarded");
  Guards guards;
  for (const Signal& signal : *signals) {
    double rest[12];
    bool have_rest = false;
    for (std::size_t e = 0; e < signal.entries(); ++e) {
      TrainedRange range;
      if (const auto it = ranges.find(within.Inner(EntryName(signal, e))); it != ranges.end()) {
        range = it->second;
      } else {
        if (!have_rest) KPSA_RETURN_IF_ERROR(RestEntries(*graph, compiler, signal, rest));
        have_rest = true;
        range = MakeTrainedRange("", rest[e], rest[e], 0);
      }
      (signal.matrix ? data.matrix_lo : data.scalar_lo).push_back(range.lo);
      (signal.matrix ? data.matrix_hi : data.scalar_hi).push_back(range.hi);
    }
    (signal.matrix ? guards.matrices : guards.scalars).push_back(signal);
  }

  // Cues: points by mesh and stage, entries of signals
  struct CueInput {
    Index mesh;
    std::size_t stage;
    std::vector<Index> points;
  };
  std::vector<CueInput> inputs;
  for (const CueDescription& cue : subspace->cues) {
    if (cue.kind != CueDescription::Kind::kPoint) continue;
    const auto& stages = target.meshes[cue.mesh].stages;
    const auto stage =
        std::find_if(stages.begin(), stages.end(), [&](const auto& s) { return s.name == cue.stage; });
    if (stage == stages.end())
      return Status::Invalid("the subspace measures at stage \"{}\" of {}, which the rig lacks", cue.stage,
                             target.meshes[cue.mesh].name);
    const auto number = static_cast<std::size_t>(stage - stages.begin());
    auto input = std::find_if(inputs.begin(), inputs.end(),
                              [&](const CueInput& i) { return i.mesh == cue.mesh && i.stage == number; });
    if (input == inputs.end()) input = inputs.insert(inputs.end(), CueInput{cue.mesh, number, {}});
    input->points.push_back(cue.point);
  }
  for (CueInput& input : inputs) {
    std::sort(input.points.begin(), input.points.end());
    input.points.erase(std::unique(input.points.begin(), input.points.end()), input.points.end());
    data.cues.push_back({input.points, target.meshes[input.mesh].stages[input.stage].world});
  }
  for (const CueDescription& cue : subspace->cues) {
    KpsaConfig::Row row;
    if (cue.kind == CueDescription::Kind::kPoint) {
      for (std::size_t i = 0; i < inputs.size(); ++i) {
        if (inputs[i].mesh != cue.mesh || target.meshes[cue.mesh].stages[inputs[i].stage].name != cue.stage)
          continue;
        row.input = static_cast<Index>(i);
        row.element =
            static_cast<Index>(std::lower_bound(inputs[i].points.begin(), inputs[i].points.end(), cue.point) -
                               inputs[i].points.begin());
      }
    } else {
      const SignalEntry split = SplitEntryName(cue.plug);
      Result<Signal> signal = FindSignal(*graph, split.signal, within);
      if (!signal.ok()) return signal.status();
      if (signal->matrix != split.entry.has_value() || split.entry.value_or(0) > 11)
        return Status::Invalid(
            "the subspace measures \"{}\", which is no entry of a matrix (plug/0 to plug/11)", cue.plug);
      row.kind = signal->matrix ? KpsaConfig::Row::Kind::kMatrix : KpsaConfig::Row::Kind::kScalar;
      row.element = static_cast<Index>(split.entry.value_or(0));
      auto& list = signal->matrix ? guards.matrices : guards.scalars;
      const std::size_t before = list.size();
      row.input = Place(&list, *signal);
      if (list.size() != before) {  // a cue that needs no guard (in the chain of the space)
        constexpr double kAnything = std::numeric_limits<double>::infinity();
        (signal->matrix ? data.matrix_lo : data.scalar_lo)
            .insert((signal->matrix ? data.matrix_lo : data.scalar_lo).end(), signal->entries(), -kAnything);
        (signal->matrix ? data.matrix_hi : data.scalar_hi)
            .insert((signal->matrix ? data.matrix_hi : data.scalar_hi).end(), signal->entries(), kAnything);
      }
    }
    data.rows.push_back(row);
  }
  for (const AccelerationTarget::MeshPoints& mesh : target.meshes)
    data.outputs_in_space.push_back(mesh.stages.back().world);
  for (const auto* list : {&guards.matrices, &guards.scalars}) {
    for (const Signal& signal : *list) data.guard_names.push_back(signal.name);
  }

  // The rewrite
  std::vector<std::vector<Connection>> consumers;
  for (const AccelerationTarget::MeshPoints& mesh : target.meshes) {
    consumers.emplace_back();
    const PlugRef& points = mesh.stages.back().points;
    for (const Connection& c : graph->Outputs(points.node)) {
      if (c.source == points) consumers.back().push_back(c);
    }
  }
  Result<NodeId> node = graph->AddNode("kpsa", node_name);
  if (!node.ok()) return node.status();
  const NodeDef& def = graph->def(*node);
  const auto plug = [&](const char* name, int element = -1) {
    return PlugRef{*node, def.FindAttribute(name), element, -1};
  };
  result.node = *node;
  result.config = std::make_shared<const KpsaConfig>(std::move(data));
  Status status;
  const auto note = [&](Status s) { status.Append(std::move(s)); };
  note(graph->Set(plug("config"), Value(result.config)));
  note(graph->Set(plug("tolerance"),
                  std::min(options.tolerance < 0 ? subspace->tolerance : options.tolerance, kAnyError)));
  note(graph->Set(plug("violationRate"),
                  options.violation_rate < 0 ? subspace->violation_rate : options.violation_rate));
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    note(graph->Connect(target.meshes[inputs[i].mesh].stages[inputs[i].stage].points,
                        plug("cues", static_cast<int>(i))));
  }
  for (std::size_t j = 0; j < guards.matrices.size(); ++j)
    note(graph->Connect(guards.matrices[j].plug, plug("matrices", static_cast<int>(j))));
  for (std::size_t k = 0; k < guards.scalars.size(); ++k)
    note(graph->Connect(guards.scalars[k].plug, plug("scalars", static_cast<int>(k))));
  if (!target.space.empty()) note(graph->Connect(target.space[0], plug("spaceMatrix")));
  std::vector<std::string> names;
  for (std::size_t m = 0; m < target.meshes.size(); ++m) {
    names.push_back(target.meshes[m].name);
    note(graph->Connect(target.meshes[m].stages.back().points, plug("fullPoints", static_cast<int>(m))));
  }
  graph->SetElementNames(*node, def.FindAttribute("outPoints"), names);
  for (std::size_t m = 0; m < consumers.size(); ++m) {
    for (const Connection& c : consumers[m])
      note(graph->Connect(plug("outPoints", static_cast<int>(m)), c.destination, true));
  }
  if (!status.ok()) return status;
  return result;
}

}  // namespace kpsa
