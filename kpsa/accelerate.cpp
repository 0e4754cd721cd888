#include "kpsa/accelerate.h"

#include <algorithm>
#include <charconv>
#include <map>
#include <set>

#include "base/check.h"
#include "graph/evaluator.h"
#include "kpsa/signature.h"
#include "kpsa/space_frame.h"
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

// The signal of an entry, and which entry it is: "jaw.matrix/3", or a scalar's name.
Result<Signal> FindEntry(const Graph& graph, const std::string& name, const RigWithin& within,
                         Index* entry = nullptr) {
  const std::size_t slash = name.rfind('/');
  Result<Signal> signal = FindSignal(graph, name.substr(0, slash), within);
  if (!signal.ok()) return signal.status();
  Index number = 0;
  const char* const end = name.data() + name.size();
  const char* const begin = slash == std::string::npos ? end : name.data() + slash + 1;
  if (signal->matrix && (std::from_chars(begin, end, number).ptr != end || begin == end || number > 11))
    return Status::Invalid("the subspace measures \"{}\", which is no entry of a matrix (plug/0 to plug/11)",
                           name);
  if (entry != nullptr) *entry = number;
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

}  // namespace

std::vector<PlugRef> AccelerationTarget::outputs() const {
  std::vector<PlugRef> plugs;
  for (const MeshPoints& mesh : meshes) plugs.push_back(mesh.stages.back().points);
  return plugs;
}

// What belongs to a KPSA node before it is there.
struct Accelerator::Entry {
  AccelerationTarget target;
  AccelerateOptions options;
  std::string node_name;
  std::shared_ptr<const KpsaConfig> config;
  std::vector<PlugRef> cues;  // by input
  Guards guards;
  std::vector<std::string> notes;
};

namespace {

// Points by mesh and stage that cues measure.
struct CueInput {
  Index mesh;
  std::size_t stage;
  std::vector<Index> points;
};

// The same rig as in training? Fills in what makes every frame a miss where the caller asked for that.
Status CheckRig(const Graph& graph, const AccelerationTarget& target, const Subspace& subspace,
                const AccelerateOptions& options, KpsaConfig::Data* data, std::vector<std::string>* notes) {
  if (subspace.outputs.size() != target.meshes.size()) {
    return Status::Invalid("the subspace is for {} meshes, the rig accelerates {}", subspace.outputs.size(),
                           target.meshes.size());
  }
  for (std::size_t m = 0; m < target.meshes.size(); ++m) {
    if (subspace.outputs[m].name != target.meshes[m].name) {
      return Status::Invalid("the subspace is for {}, the rig accelerates {}", subspace.outputs[m].name,
                             target.meshes[m].name);
    }
  }
  const Signature trained = TrainedSignature(subspace);
  if (SignatureDigest(trained) != subspace.rig_hash)
    return Status::Invalid("the subspace is corrupt: its rig hash is not that of the rig that it describes");
  const std::string difference = SignatureDifference(
      trained, RigSignature(graph, target.outputs(), target.space, target.controls, target.within));
  if (!difference.empty()) {
    if (!options.stale_is_miss) {
      return Status::Invalid(
          "the subspace is stale: since it was trained, {} changed; train it again, or use --stale miss",
          difference);
    }
    data->always_miss = true;
    data->always_miss_reason = fmt::format("the subspace is stale ({} changed)", difference);
    notes->push_back(
        fmt::format("the subspace is stale ({} changed): every frame is evaluated fully", difference));
  }
  if (subspace.space != target.space_name) {
    return Status::Invalid("the subspace lives in space \"{}\", the rig asks for \"{}\"", subspace.space,
                           target.space_name);
  }
  return Status();
}

// Transforms above the space that move the points with it: those that training found, and what a reference
// hangs under, which moves all of the rig.
std::set<Index> CarriedNodes(const Graph& graph, const AccelerationTarget& target, const Subspace& subspace) {
  std::set<Index> carried;
  if (target.space.empty()) return carried;
  for (const NodeId node : ParentsFrom(graph, target.space[0].node)) {
    const std::string& name = graph.name(node);
    const bool inner = name.starts_with(target.within.prefix) && !(node == target.within.root);
    const std::string known = target.within.Inner(name);
    if (!inner ||
        std::find(subspace.carried.begin(), subspace.carried.end(), known) != subspace.carried.end())
      carried.insert(node.index);
  }
  return carried;
}

// What may stretch the space, by name: transforms of its chain whose local matrix is no rotation now, else
// those whose scale may vary, else the space.
std::string StretchedName(const Graph& graph, Compiler* compiler, const AccelerationTarget& target) {
  if (target.space.empty()) return "the space";
  std::string varying;
  for (const NodeId node : ParentsFrom(graph, target.space[0].node)) {
    const int scale = graph.def(node).FindAttribute("scale"),
              matrix = graph.def(node).FindAttribute("matrix");
    if (scale < 0 || matrix < 0) continue;
    const PlugRef plug{node, matrix, -1, -1};
    const Result<Value> rest = compiler->Rest(graph, plug);
    Request request;
    request.outputs.push_back({plug, {}});
    const auto plan = compiler->Compile(graph, request);
    if (rest.ok() && plan.ok()) {
      Evaluator evaluator(*plan);
      if (evaluator.Evaluate().ok()) {
        const SpaceFrame frame =
            SpaceFrameOf(evaluator.Get<Matrix4>(0), InverseRestStretch(rest->get<Matrix4>()));
        if (frame.stretch > 1e-6 || frame.scale != 1) return graph.name(node);
      }
    }
    for (const PlugRef& v : target.varying) {
      if (v.node == node && v.attribute == scale) varying = graph.name(node);
    }
  }
  return varying.empty() ? graph.name(target.space[0].node) : varying;
}

// Guards of what varies here: with its trained range, or, if it never moved there, its rest value.
Status AddGuards(const Graph& graph, Compiler* compiler, const AccelerationTarget& target,
                 const Subspace& subspace, KpsaConfig::Data* data, Guards* guards,
                 std::vector<std::string>* notes) {
  const std::set<Index> carried = CarriedNodes(graph, target, subspace);
  std::vector<std::string> unguarded;
  Result<std::vector<Signal>> signals =
      FindSignals(graph, compiler, target.outputs(), target.varying, carried, &unguarded);
  if (!signals.ok()) return signals.status();
  if (!unguarded.empty()) {
    data->always_miss = true;
    data->always_miss_reason = fmt::format("{} varies and cannot be guarded", unguarded[0]);
    notes->push_back(data->always_miss_reason + ": every frame is evaluated fully");
  }
  std::map<std::string, TrainedRange> ranges;
  for (const TrainedRange& range : subspace.ranges) ranges.emplace(range.plug, range);
  for (const Signal& signal : *signals) {
    double rest[12];
    bool have_rest = false;
    for (std::size_t e = 0; e < signal.entries(); ++e) {
      TrainedRange range;
      if (const auto it = ranges.find(target.within.Inner(EntryName(signal, e))); it != ranges.end()) {
        range = it->second;
      } else {
        if (!have_rest) KPSA_RETURN_IF_ERROR(RestEntries(graph, compiler, signal, rest));
        have_rest = true;
        range = MakeTrainedRange("", rest[e], rest[e], 0, 0);
      }
      (signal.matrix ? data->matrix_lo : data->scalar_lo).push_back(range.lo);
      (signal.matrix ? data->matrix_hi : data->scalar_hi).push_back(range.hi);
      (signal.matrix ? data->matrix_ramp : data->scalar_ramp).push_back(range.ramp);
    }
    (signal.matrix ? guards->matrices : guards->scalars).push_back(signal);
  }

  // What was trained and rests here: where it is now
  std::vector<Signal> resting;
  for (const TrainedRange& range : subspace.ranges) {
    const Result<Signal> signal = FindEntry(graph, range.plug, target.within);
    if (!signal.ok() || carried.count(signal->plug.node.index) != 0) continue;
    const auto same = [&](const Signal& other) { return other.plug == signal->plug; };
    if (std::none_of(signals->begin(), signals->end(), same) &&
        std::none_of(resting.begin(), resting.end(), same))
      resting.push_back(*signal);
  }
  if (resting.empty()) return Status();
  Request request;
  for (const Signal& signal : resting) request.outputs.push_back({signal.plug, {}});
  const auto plan = compiler->Compile(graph, request);
  if (!plan.ok()) return plan.status();
  Evaluator evaluator(*plan);
  KPSA_RETURN_IF_ERROR(evaluator.Evaluate());
  for (Index o = 0; o < resting.size(); ++o) {
    double entries[12];
    if (resting[o].matrix) {
      MatrixEntries(evaluator.Get<Matrix4>(o), entries);
    } else {
      entries[0] = (*plan)->outputs()[o].type == Type::kDouble
                       ? evaluator.Get<double>(o)
                       : static_cast<double>(evaluator.Get<std::int64_t>(o));
    }
    for (std::size_t e = 0; e < resting[o].entries(); ++e) {
      const auto it = ranges.find(target.within.Inner(EntryName(resting[o], e)));
      if (it == ranges.end() || data->always_miss) continue;
      if (GuardWeight(it->second.lo, it->second.hi, it->second.ramp, entries[e]) == 0) continue;
      data->always_miss = true;
      data->always_miss_reason = fmt::format("{} is set outside its trained range", resting[o].name);
      notes->push_back(data->always_miss_reason + ": every frame is evaluated fully");
    }
  }
  return Status();
}

// Where the rows of the measurement come from.
Status AddCues(const Graph& graph, const AccelerationTarget& target, const Subspace& subspace,
               KpsaConfig::Data* data, Guards* guards, std::vector<CueInput>* cue_inputs) {
  std::vector<CueInput>& inputs = *cue_inputs;
  for (const CueDescription& cue : subspace.cues) {
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
    data->cues.push_back({input.points, target.meshes[input.mesh].stages[input.stage].world});
  }
  for (const CueDescription& cue : subspace.cues) {
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
      const Result<Signal> signal = FindEntry(graph, cue.plug, target.within, &row.element);
      if (!signal.ok()) return signal.status();
      row.kind = signal->matrix ? KpsaConfig::Row::Kind::kMatrix : KpsaConfig::Row::Kind::kScalar;
      auto& list = signal->matrix ? guards->matrices : guards->scalars;
      const std::size_t before = list.size();
      row.input = Place(&list, *signal);
      if (list.size() != before) {  // a cue that needs no guard
        constexpr double kAnything = std::numeric_limits<double>::infinity();
        const auto add = [&](std::vector<double>* to, double value) {
          to->insert(to->end(), signal->entries(), value);
        };
        add(signal->matrix ? &data->matrix_lo : &data->scalar_lo, -kAnything);
        add(signal->matrix ? &data->matrix_hi : &data->scalar_hi, kAnything);
        add(signal->matrix ? &data->matrix_ramp : &data->scalar_ramp, 0);
      }
    }
    data->rows.push_back(row);
  }
  return Status();
}

// All nodes that points depend on, their own included.
std::set<Index> NodesAbove(const Graph& graph, const std::vector<PlugRef>& points) {
  std::set<Index> above;
  std::vector<NodeId> stack;
  const auto visit = [&](NodeId node) {
    if (above.insert(node.index).second) stack.push_back(node);
  };
  for (const PlugRef& plug : points) visit(plug.node);
  while (!stack.empty()) {
    const NodeId node = stack.back();
    stack.pop_back();
    for (const Connection& c : graph.Inputs(node)) visit(c.source.node);
  }
  return above;
}

}  // namespace

Status Accelerator::Add(const AccelerationTarget& target, std::shared_ptr<const Subspace> subspace,
                        const std::string& node_name, const AccelerateOptions& options) {
  auto entry = std::make_shared<Entry>();
  entry->target = target, entry->options = options, entry->node_name = node_name;
  KpsaConfig::Data data;
  data.subspace = subspace;
  KPSA_RETURN_IF_ERROR(CheckRig(*graph_, target, *subspace, options, &data, &entry->notes));
  KPSA_RETURN_IF_ERROR(
      AddGuards(*graph_, compiler_, target, *subspace, &data, &entry->guards, &entry->notes));
  std::vector<CueInput> inputs;
  KPSA_RETURN_IF_ERROR(AddCues(*graph_, target, *subspace, &data, &entry->guards, &inputs));
  for (const CueInput& input : inputs)
    entry->cues.push_back(target.meshes[input.mesh].stages[input.stage].points);
  for (const AccelerationTarget::MeshPoints& mesh : target.meshes)
    data.outputs_in_space.push_back(mesh.stages.back().world);
  for (const auto* list : {&entry->guards.matrices, &entry->guards.scalars}) {
    for (const Signal& signal : *list) data.guard_names.push_back(signal.name);
  }
  data.has_space = !target.space.empty();
  // A reference hangs under its root as a whole, and grows with it
  data.space_scales = data.has_space && (subspace->space_scales || subspace->space.empty());
  if (data.has_space) data.stretched = StretchedName(*graph_, compiler_, target);
  entry->config = std::make_shared<const KpsaConfig>(std::move(data));
  entries_.push_back(std::move(entry));
  return Status();
}

Result<std::vector<Accelerated>> Accelerator::Apply() {
  std::vector<PlugRef> points;
  for (const auto& entry : entries_) {
    for (const PlugRef& plug : entry->target.outputs()) points.push_back(plug);
  }
  const std::set<Index> above = NodesAbove(*graph_, points);
  std::vector<Accelerated> results;
  Status status;
  const auto note = [&](Status s) { status.Append(std::move(s)); };
  for (const auto& entry : entries_) {
    // Who reads the points, but for what other accelerated points come from
    const AccelerationTarget& target = entry->target;
    std::vector<std::vector<Connection>> consumers;
    for (const PlugRef& output : target.outputs()) {
      consumers.emplace_back();
      for (const Connection& c : graph_->Outputs(output.node)) {
        if (c.source == output && above.count(c.destination.node.index) == 0) consumers.back().push_back(c);
      }
    }
    Result<NodeId> node = graph_->AddNode("kpsa", entry->node_name);
    if (!node.ok()) return node.status();
    const NodeDef& def = graph_->def(*node);
    const auto plug = [&](const char* name, int element = -1) {
      return PlugRef{*node, def.FindAttribute(name), element, -1};
    };
    const Subspace& subspace = *entry->config->data().subspace;
    const AccelerateOptions& options = entry->options;
    note(graph_->Set(plug("config"), Value(AssetPtr(entry->config))));
    note(graph_->Set(plug("tolerance"),
                     std::min(options.tolerance < 0 ? subspace.tolerance : options.tolerance, kAnyError)));
    note(graph_->Set(plug("violationRate"),
                     options.violation_rate < 0 ? subspace.violation_rate : options.violation_rate));
    for (std::size_t i = 0; i < entry->cues.size(); ++i)
      note(graph_->Connect(entry->cues[i], plug("cues", static_cast<int>(i))));
    for (std::size_t j = 0; j < entry->guards.matrices.size(); ++j)
      note(graph_->Connect(entry->guards.matrices[j].plug, plug("matrices", static_cast<int>(j))));
    for (std::size_t k = 0; k < entry->guards.scalars.size(); ++k)
      note(graph_->Connect(entry->guards.scalars[k].plug, plug("scalars", static_cast<int>(k))));
    if (!target.space.empty()) note(graph_->Connect(target.space[0], plug("spaceMatrix")));
    std::vector<std::string> names;
    for (std::size_t m = 0; m < target.meshes.size(); ++m) {
      names.push_back(target.meshes[m].name);
      note(graph_->Connect(target.meshes[m].stages.back().points, plug("fullPoints", static_cast<int>(m))));
    }
    graph_->SetElementNames(*node, def.FindAttribute("outPoints"), names);
    for (std::size_t m = 0; m < consumers.size(); ++m) {
      for (const Connection& c : consumers[m])
        note(graph_->Connect(plug("outPoints", static_cast<int>(m)), c.destination, true));
    }
    results.push_back({*node, entry->config, entry->notes});
  }
  if (!status.ok()) return status;
  return results;
}

Result<Accelerated> Accelerate(Graph* graph, Compiler* compiler, const AccelerationTarget& target,
                               std::shared_ptr<const Subspace> subspace, const std::string& node_name,
                               const AccelerateOptions& options) {
  Accelerator accelerator(graph, compiler);
  KPSA_RETURN_IF_ERROR(accelerator.Add(target, std::move(subspace), node_name, options));
  Result<std::vector<Accelerated>> applied = accelerator.Apply();
  if (!applied.ok()) return applied.status();
  return std::move(applied->front());
}

}  // namespace kpsa
