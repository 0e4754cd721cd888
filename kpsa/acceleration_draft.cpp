#include "kpsa/acceleration_draft.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <unordered_map>

#include "graph/evaluator.h"
#include "kpsa/partial_step.h"
#include "kpsa/signature.h"
#include "kpsa/space_frame.h"

namespace kpsa::engine {
namespace {

// Signals by what a subspace calls them, each looked up once: many cues are entries of the same one.
class NamedSignals {
 public:
  NamedSignals(const Graph& graph, const RigWithin& within) : graph_(graph), within_(within) {}
  Result<const Signal*> Find(const std::string& name) {
    const auto known = found_.find(name);
    if (known != found_.end()) return &known->second;
    Result<PlugRef> plug = graph_.FindPlug(within_.prefix + name);
    if (!plug.ok() && !within_.prefix.empty()) plug = graph_.FindPlug(name);  // time
    if (!plug.ok()) return plug.status();
    Signal signal{graph_.PlugName(*plug), *plug, graph_.PlugType(*plug) == Type::kMatrix,
                  IsWorldMatrix(graph_, *plug)};
    return &found_.emplace(name, std::move(signal)).first->second;
  }

 private:
  const Graph& graph_;
  const RigWithin& within_;
  std::unordered_map<std::string, Signal> found_;
};

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

using RangesByPlug = std::unordered_map<std::string_view, const TrainedRange*>;

// What may vary, and what is set here without varying: guards look at both. What is set and was never moved
// in training has no range that says how far it may go, and is a miss whatever its value.
std::vector<PlugRef> GuardedPlugs(const Graph& graph, const AccelerationTarget& target, const TrainedRig& rig,
                                  const RangesByPlug& ranges, const std::vector<SetHere>& set_here,
                                  AccelerationDraft* draft) {
  const std::set<std::string> controls(rig.controls.begin(), rig.controls.end());
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
    draft->AlwaysMiss(untrained[0] + " is set, and the subspace never saw it move");
  } else if (!untrained.empty()) {
    draft->AlwaysMiss(fmt::format("{} and {} more are set, and the subspace never saw them move",
                                  untrained[0], untrained.size() - 1));
  }
  return guarded;
}

// The same rig as in training?
Status CheckRig(const Graph& graph, const AccelerationTarget& target, const Subspace& subspace,
                const AccelerateOptions& options, AccelerationDraft* draft, std::vector<SetHere>* set_here) {
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
  const Signature& trained = subspace.rig.signature;
  if (SignatureDigest(trained) != subspace.rig_hash)
    return Status::Invalid("the subspace is corrupt: its rig hash is not that of the rig that it describes");
  Signature now = RigSignature(graph, target.outputs(), target.space, target.controls, target.within);
  *set_here =
      TakeSetHere(graph, target.outputs(), target.space, target.controls, target.within, trained, &now);
  if (const std::string difference = SignatureDifference(trained, now); !difference.empty()) {
    if (!options.stale_is_miss) {
      return Status::Invalid("the subspace is stale: since it was trained, {} changed; train it again{}",
                             difference,
                             options.stale_option.empty()
                                 ? ""
                                 : fmt::format(", or let all its frames miss ({})", options.stale_option));
    }
    draft->AlwaysMiss(fmt::format("the subspace is stale ({} changed)", difference));
  }
  for (const SetHere& set : *set_here) {
    if (!set.structural) continue;
    if (!options.stale_is_miss) {
      return Status::Invalid(
          "{} is set to {} here, the subspace was trained on what the rig says; evaluate without subspaces, "
          "or train a rig that says so",
          set.name, set.value);
    }
    draft->AlwaysMiss(fmt::format("{} is set to {} here, and the subspace was trained on what the rig says",
                                  set.name, set.value));
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

// The world matrices that cues are measured by: what turns their transforms is guarded, also where it moves no point.
std::vector<PlugRef> MatricesRead(const Subspace& subspace, NamedSignals* named) {
  std::set<std::string> names;
  for (const CueDescription& cue : subspace.cues) {
    if (cue.kind == CueDescription::Kind::kScalar) names.insert(SplitEntryName(cue.plug).signal);
    if (!cue.joint.empty()) names.insert(cue.joint);
  }
  std::vector<PlugRef> plugs;
  for (const std::string& name : names) {
    const Result<const Signal*> signal = named->Find(name);
    if (signal.ok() && (*signal)->relative) plugs.push_back((*signal)->plug);
  }
  return plugs;
}

bool NeedsSteps(const Subspace& subspace) { return subspace.of_inner() || !subspace.mends.empty(); }

// Of each mesh, the points that may have a last step which no control reaches; without an attribute (-1): none.
std::vector<PlugRef> SplittablePoints(const Graph& graph, const AccelerationTarget& target) {
  std::vector<PlugRef> splittable(target.meshes.size());
  for (std::size_t m = 0; m < splittable.size() && !target.colors; ++m) {
    const PlugRef& points = target.meshes[m].stages.back().points;
    const auto varies = [&](const PlugRef& plug) {
      return plug.node == points.node && graph.PlugType(plug) != Type::kMatrix;
    };
    if (std::ranges::any_of(target.varying, varies) || std::ranges::any_of(target.controls, varies)) continue;
    splittable[m] = points;
  }
  return splittable;
}

// Guards of what varies or is set here: with its trained range, or, if it never moved there, its rest value.
Status AddGuards(const Graph& graph, Compiler* compiler, const AccelerationTarget& target,
                 const Subspace& subspace, const std::vector<SetHere>& set_here, NamedSignals* named,
                 AccelerationDraft* draft, std::vector<Compiler::SplitPoints>* split) {
  KpsaConfig::Data& data = draft->data;
  RangesByPlug ranges;
  for (const TrainedRange& range : subspace.ranges) ranges.emplace(range.plug, &range);
  const std::vector<PlugRef> varying = GuardedPlugs(graph, target, subspace.rig, ranges, set_here, draft);
  std::vector<std::string> unguarded;
  std::vector<PlugRef> plugs = target.outputs();
  for (const PlugRef& plug : MatricesRead(subspace, named)) plugs.push_back(plug);
  Request request;
  for (const PlugRef& plug : plugs) request.outputs.push_back({plug, {}});
  request.varying = varying;
  Result<Compiler::Survey> survey = compiler->SurveyOf(
      graph, request,
      NeedsSteps(subspace) && !data.always_miss ? SplittablePoints(graph, target) : std::vector<PlugRef>());
  if (!survey.ok()) return survey.status();
  *split = std::move(survey->split);
  Result<std::vector<Signal>> signals =
      FindSignals(graph, survey->steps, varying, CarriedNodes(graph, target, subspace), &unguarded);
  if (!signals.ok()) return signals.status();
  if (!unguarded.empty()) draft->AlwaysMiss(unguarded[0] + " varies and cannot be guarded");
  const bool limited = std::isfinite(subspace.activity_limit);
  for (const Signal& signal : *signals) {
    double rest[12];
    bool have_rest = false;
    std::uint64_t patches = 0;
    std::string name = target.within.Inner(signal.name);  // and of its entries, as EntryName has them
    const std::size_t length = name.size();
    for (std::size_t e = 0; e < signal.entries(); ++e) {
      TrainedRange range;
      if (signal.matrix) name.resize(length), name.append("/").append(std::to_string(e));
      if (const auto it = ranges.find(name); it != ranges.end()) {
        range.lo = it->second->lo, range.hi = it->second->hi, range.ramp = it->second->ramp;
        range.patches = it->second->patches;
        range.rest = it->second->rest, range.reach = it->second->reach;
      } else {
        if (!have_rest) KPSA_RETURN_IF_ERROR(RestEntries(graph, compiler, signal, rest));
        have_rest = true;
        range = MakeTrainedRange("", rest[e], rest[e], 0, 0);
      }
      (signal.matrix ? data.matrix_lo : data.scalar_lo).push_back(range.lo);
      (signal.matrix ? data.matrix_hi : data.scalar_hi).push_back(range.hi);
      (signal.matrix ? data.matrix_ramp : data.scalar_ramp).push_back(range.ramp);
      if (limited) {
        (signal.matrix ? data.matrix_rest : data.scalar_rest).push_back(range.rest);
        (signal.matrix ? data.matrix_per_reach : data.scalar_per_reach).push_back(range.per_reach());
      }
      patches |= range.patches;
    }
    (signal.matrix ? data.matrix_patches : data.scalar_patches).push_back(patches);
    (signal.matrix ? draft->matrices : draft->scalars).push_back(signal);
  }
  return Status();
}

// The inputs of signals that are measured, whether guards look at them or not.
class CueSignals {
 public:
  CueSignals(NamedSignals* named, AccelerationDraft* draft) : named_(named), draft_(draft) {
    for (const bool matrix : {false, true}) {
      std::vector<Signal>& list = ListOf(matrix);
      for (Index i = 0; i < list.size(); ++i) places_.emplace(list[i].name, i);
    }
  }

  // The row of a scalar, which may be an entry of a matrix.
  Result<KpsaConfig::Row> RowOf(const std::string& plug) {
    const SignalEntry split = SplitEntryName(plug);
    const Result<const Signal*> signal = named_->Find(split.signal);
    if (!signal.ok()) return signal.status();
    const bool is_matrix = (*signal)->matrix;
    if (is_matrix != split.entry.has_value() || split.entry.value_or(0) > 11)
      return Status::Invalid(
          "the subspace measures \"{}\", which is no entry of a matrix (plug/0 to plug/11)", plug);
    KpsaConfig::Row row;
    row.kind = is_matrix ? KpsaConfig::Row::Kind::kMatrix : KpsaConfig::Row::Kind::kScalar;
    row.element = static_cast<Index>(split.entry.value_or(0));
    row.input = Place(**signal);
    return row;
  }
  // The matrix in whose space something is measured.
  Result<Index> JointOf(const std::string& plug) {
    const Result<const Signal*> signal = named_->Find(plug);
    if (!signal.ok()) return signal.status();
    const Index input = Place(**signal);
    return (*signal)->relative ? input : kNoIndex;
  }

 private:
  // A signal that is no input yet becomes one.
  Index Place(const Signal& signal) {
    std::vector<Signal>& list = ListOf(signal.matrix);
    const auto [place, is_new] = places_.emplace(signal.name, static_cast<Index>(list.size()));
    if (!is_new) return place->second;
    list.push_back(signal);
    constexpr double kAnything = std::numeric_limits<double>::infinity();
    KpsaConfig::Data& data = draft_->data;
    const auto add = [&](std::vector<double>* to, double value) {
      to->insert(to->end(), signal.entries(), value);
    };
    add(signal.matrix ? &data.matrix_lo : &data.scalar_lo, -kAnything);
    add(signal.matrix ? &data.matrix_hi : &data.scalar_hi, kAnything);
    add(signal.matrix ? &data.matrix_ramp : &data.scalar_ramp, 0);
    if (std::isfinite(data.subspace->activity_limit)) {
      add(signal.matrix ? &data.matrix_rest : &data.scalar_rest, 0);
      add(signal.matrix ? &data.matrix_per_reach : &data.scalar_per_reach, 0);
    }
    (signal.matrix ? data.matrix_patches : data.scalar_patches).push_back(kAllPatches);
    return place->second;
  }
  std::vector<Signal>& ListOf(bool matrix) { return matrix ? draft_->matrices : draft_->scalars; }
  NamedSignals* named_;
  AccelerationDraft* draft_;
  std::unordered_map<std::string, Index> places_;  // a signal is in one of both lists
};

// Where the rows of the measurement come from.
Status AddCues(const AccelerationTarget& target, const Subspace& subspace, NamedSignals* named,
               AccelerationDraft* draft) {
  KpsaConfig::Data* const data = &draft->data;
  struct CueInput {  // points by mesh and stage
    Index mesh;
    std::size_t stage;
    std::vector<Index> points;
  };
  std::vector<CueInput> inputs;
  CueSignals signals(named, draft);
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
    draft->cues.push_back(target.meshes[input.mesh].stages[input.stage].points);
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
    } else if (cue.kind == CueDescription::Kind::kScalar) {
      const Result<KpsaConfig::Row> scalar = signals.RowOf(cue.plug);
      if (!scalar.ok()) return scalar.status();
      row = *scalar;
    } else {
      KpsaConfig::Product product;
      product.lo = cue.lo, product.hi = cue.hi;
      for (std::size_t f = 0; f < cue.factors.size(); ++f) {
        const Result<KpsaConfig::Row> factor = signals.RowOf(cue.factors[f].plug);
        if (!factor.ok()) return factor.status();
        (f == 0 ? product.a : product.b) = *factor;
        (f == 0 ? product.of_a : product.of_b) = cue.factors[f].curve;
        if (factor->kind == KpsaConfig::Row::Kind::kMatrix && draft->matrices[factor->input].relative)
          return Status::Invalid("the subspace multiplies \"{}\", which is an entry of a world matrix",
                                 cue.factors[f].plug);
      }
      row.kind = KpsaConfig::Row::Kind::kProduct;
      row.input = static_cast<Index>(data->products.size());
      data->products.push_back(product);
    }
    if (!cue.joint.empty()) {
      const Result<Index> joint = signals.JointOf(cue.joint);
      if (!joint.ok()) return joint.status();
      if (*joint == kNoIndex ||
          (row.kind != KpsaConfig::Row::Kind::kMatrix && row.kind != KpsaConfig::Row::Kind::kPoint))
        return Status::Invalid("the subspace measures in the space of \"{}\", which is no world matrix",
                               cue.joint);
      const auto found = std::find(data->joints.begin(), data->joints.end(), *joint);
      row.joint = static_cast<Index>(found - data->joints.begin());
      if (found == data->joints.end()) data->joints.push_back(*joint);
    }
    data->rows.push_back(row);
  }
  return Status();
}

// What may stretch the space, by name: transforms of its chain whose local matrix is no rotation now, else
// those whose scale may vary, else the space.
std::string StretchedName(const Graph& graph, Compiler* compiler, const AccelerationTarget& target) {
  if (target.space.empty()) return "the space";
  std::string varying = graph.name(target.space[0].node);
  std::vector<NodeId> nodes;
  Request request;
  bool may_be_now = false;  // others rest
  for (const NodeId node : ParentsFrom(graph, target.space[0].node)) {
    const int scale = graph.def(node).FindAttribute("scale"),
              matrix = graph.def(node).FindAttribute("matrix");
    if (scale < 0 || matrix < 0) continue;
    nodes.push_back(node);
    request.outputs.push_back({{node, matrix, -1, -1}, {}});
    may_be_now |= graph.IsPosed(node, scale) || !graph.Inputs(node, scale).empty();
    for (const PlugRef& v : target.varying) {
      if (v.node == node && v.attribute == scale) varying = graph.name(node);
    }
  }
  if (!may_be_now) return varying;
  // As they are now, by a compiler of its own: the other one keeps kernels of the last compilation
  if (const auto plan = Compiler().Compile(graph, request); plan.ok()) {
    Evaluator evaluator(*plan);
    const bool is_good = evaluator.Evaluate().ok();
    for (std::size_t i = 0; i < nodes.size() && is_good; ++i) {
      const Result<Value> rest = compiler->Rest(graph, request.outputs[i].plug);
      if (!rest.ok()) continue;
      const SpaceFrame frame =
          SpaceFrameOf(evaluator.Get<Matrix4>(i), InverseRestStretch(rest->get<Matrix4>()));
      if (frame.stretch > 1e-6 || frame.scale != 1) return graph.name(nodes[i]);
    }
  }
  return varying;
}

// Where the points of the patches lie, from the points at rest.
Status PlacePatches(const Graph& graph, Compiler* compiler, const AccelerationTarget& target,
                    AccelerationDraft* draft) {
  const std::size_t tiles = draft->data.subspace->patches.tiles;
  if (tiles == 0 || draft->data.always_miss) return Status();
  std::vector<PlacedOutput> placed;
  for (std::size_t m = 0; m < target.meshes.size(); ++m) {
    Result<std::vector<Double3>> rest = RestPoints(graph, compiler, target.meshes[m].stages.back().points);
    if (!rest.ok()) return rest.status();
    placed.push_back({std::move(*rest), draft->data.subspace->outputs[m].stepped.starts});
  }
  draft->data.patches = MakePatches(placed, tiles);
  return Status();
}

// What gives the points from inner ones, where the subspace reconstructs these.
Status FindSteps(const std::vector<Compiler::SplitPoints>& split, AccelerationDraft* draft) {
  const Subspace& subspace = *draft->data.subspace;
  if (!NeedsSteps(subspace) || draft->data.always_miss) return Status();
  for (std::size_t m = 0; m < subspace.outputs.size(); ++m) {
    const SubspaceOutput& output = subspace.outputs[m];
    std::shared_ptr<const LastStep>& step = draft->data.steps.emplace_back();
    const std::shared_ptr<const LastStep>& here = split[m].step;
    // What it has besides points may vary here: points come out as calibration had them
    if (here == nullptr) {
      if (output.inner > 0)
        draft->AlwaysMiss(
            fmt::format("the last step of {} may vary, which the subspace stands before", output.name));
      continue;
    }
    for (const TileMend& mend : subspace.mends) {
      if (mend.output != m) continue;
      step = here;
      if (here->points() != output.points ||
          here->InnerOf(PointSet::Of(mend.points, static_cast<Index>(output.points))) != mend.inner)
        return Status::Invalid(
            "the subspace mends points of {} by a last step that the rig lacks; train it again", output.name);
    }
    if (output.inner == 0) continue;
    step = here;
    if (here->points() == output.points && !output.stepped.empty())
      step = MakePartialStep(here, output.stepped);
    if (here->points() != output.points || step == nullptr || step->inner_points() != output.inner)
      return Status::Invalid(
          "the subspace is for {} points before the last step of {}, and the rig has {} there; train it "
          "again",
          output.inner, output.name, step == nullptr ? "others" : fmt::format("{}", step->inner_points()));
  }
  return Status();
}

}  // namespace

Result<std::vector<Compiler::SplitPoints>> SplitMeshes(const Graph& graph, Compiler* compiler,
                                                       const AccelerationTarget& target) {
  std::vector<Compiler::SplitPoints> split;
  for (const PlugRef& points : SplittablePoints(graph, target)) {
    split.emplace_back();
    if (points.attribute < 0) continue;
    Result<Compiler::SplitPoints> one = compiler->Split(graph, points);
    if (!one.ok()) return one.status();
    split.back() = std::move(*one);
  }
  return split;
}

Result<std::vector<Double3>> RestPoints(const Graph& graph, Compiler* compiler, const PlugRef& points) {
  const Result<Value> rest = compiler->Rest(graph, points);
  if (!rest.ok()) return rest.status();
  const ConstPointsView view = rest->points()->view();
  std::vector<Double3> places;
  places.reserve(view.count);
  for (std::size_t i = 0; i < view.count; ++i) places.push_back({view.x[i], view.y[i], view.z[i]});
  return places;
}

Result<AccelerationDraft> DraftAcceleration(const Graph& graph, Compiler* compiler,
                                            const AccelerationTarget& target,
                                            std::shared_ptr<const Subspace> subspace,
                                            const AccelerateOptions& options) {
  AccelerationDraft draft;
  draft.data.subspace = subspace;
  std::vector<SetHere> set_here;
  KPSA_RETURN_IF_ERROR(CheckRig(graph, target, *subspace, options, &draft, &set_here));
  std::vector<Compiler::SplitPoints> split;
  NamedSignals named(graph, target.within);
  KPSA_RETURN_IF_ERROR(AddGuards(graph, compiler, target, *subspace, set_here, &named, &draft, &split));
  KPSA_RETURN_IF_ERROR(AddCues(target, *subspace, &named, &draft));
  for (const AccelerationTarget::MeshPoints& mesh : target.meshes)
    draft.data.outputs_in_space.push_back(mesh.stages.back().world);
  KPSA_RETURN_IF_ERROR(FindSteps(split, &draft));
  for (const Signal& signal : draft.matrices) draft.data.relative.push_back(signal.relative);
  for (const auto* list : {&draft.matrices, &draft.scalars}) {
    for (const Signal& signal : *list) draft.data.guard_names.push_back(signal.name);
  }
  KPSA_RETURN_IF_ERROR(PlacePatches(graph, compiler, target, &draft));
  draft.data.has_space = !target.space.empty();
  // A reference hangs under its root as a whole, and grows with it
  draft.data.space_scales = draft.data.has_space && (subspace->space_scales || subspace->space.empty());
  if (draft.data.has_space) {
    draft.data.stretched = StretchedName(graph, compiler, target);
    const Result<Value> rest = compiler->Rest(graph, target.space[0]);
    if (!rest.ok()) return rest.status();
    const Matrix4& matrix = rest->get<Matrix4>();
    draft.data.rest_origin = {matrix(0, 3), matrix(1, 3), matrix(2, 3)};
  }
  return draft;
}

}  // namespace kpsa::engine
