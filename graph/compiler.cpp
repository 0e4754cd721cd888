#include "graph/compiler.h"

#include <map>
#include <optional>
#include <unordered_map>
#include <utility>

#include "graph/authored.h"
#include "graph/builtin_steps.h"
#include "graph/plan_builder.h"
#include "graph/static_eval.h"
#include "graph/structural_view.h"

namespace kpsa::engine {
namespace {

// Content digests of instances in the rest state: what a kernel or a rest value can depend on.
class RestDigests {
 public:
  explicit RestDigests(InstanceTable& table, const std::vector<Index>& order)
      : table_(table), digests_(table.instances().size()) {
    for (Index i : order) digests_[i] = Compute(table.instances()[i]);
  }
  const Digest& operator[](Index instance) const { return digests_[instance]; }

 private:
  const Digest& OfValue(const Value* value) {
    const auto [it, added] = values_.emplace(value, Digest());
    if (added) it->second = value->digest();
    return it->second;
  }
  void AddSource(Hasher& hasher, const Source& source) {
    hasher.Add(source.kind);
    hasher.Add(source.component);
    if (source.kind == Source::Kind::kInstance) {
      hasher.Add(digests_[source.instance]);
      hasher.Add(source.output);
      hasher.Add(source.element);
    } else {
      hasher.Add(OfValue(source.value));
    }
  }
  Digest Compute(const Instance& instance) {
    Hasher hasher;
    hasher.Add(instance.kind);
    hasher.Add(instance.type);
    for (const Input& input : instance.inputs) {
      hasher.Add(input.position);
      AddSource(hasher, input.rest);
      if (instance.kind != Instance::Kind::kNode) continue;
      hasher.Add(input.element);
      const int attribute = table_.group(instance).inputs[static_cast<std::size_t>(input.position)];
      hasher.Add(table_.IsSet(instance.node, attribute, input.element));
    }
    for (int child : instance.children) hasher.Add(child);
    if (instance.kind != Instance::Kind::kNode) return hasher.Finish();
    const NodeDef& def = table_.graph().def(instance.node);
    hasher.Add(std::string_view(def.name));
    hasher.Add(def.version);
    hasher.Add(instance.group);
    hasher.Add(instance.geometry);
    for (int size : instance.output_sizes) hasher.Add(size);
    for (std::size_t i = 0; i < def.attributes.size(); ++i) {
      const AttributeDef& a = def.attributes[i];
      if (!a.structural) continue;
      const int attribute = static_cast<int>(i);
      const int size = a.array ? table_.ArraySize(instance.node, attribute) : 1;
      hasher.Add(size);
      for (int e = 0; e < size; ++e) {
        if (a.per_geometry && instance.geometry >= 0 && e != instance.geometry) continue;
        hasher.Add(OfValue(table_.HeldValue(instance.node, attribute, a.array ? e : -1)));
        hasher.Add(table_.IsSet(instance.node, attribute, a.array ? e : -1));
      }
    }
    for (const StructuralInput& input : instance.structural) {
      hasher.Add(input.attribute);
      hasher.Add(input.element);
      AddSource(hasher, input.source);
    }
    return hasher.Finish();
  }

  InstanceTable& table_;
  std::vector<Digest> digests_;
  std::unordered_map<const Value*, Digest> values_;
};

BoundKernel BuiltinKernel(const InstanceTable& table, const DraftStep& draft) {
  BoundKernel kernel;
  if (draft.instance == kNoIndex) {
    kernel.object = std::make_shared<const std::vector<Index>>(
        draft.sets.inputs[0].PositionsOf(draft.sets.outputs[0][0]));
    return kernel;
  }
  const Instance& instance = table.instances()[draft.instance];
  if (instance.kind != Instance::Kind::kAssemble) return kernel;
  auto assemble = std::make_shared<AssembleKernel>();
  assemble->value_size = IsPointType(instance.type) ? 0 : SlotSize(instance.type);
  assemble->children = instance.children;
  if (IsPointType(instance.type)) {
    const PointSet& set = draft.sets.outputs[0][0];
    for (int& child : assemble->children) {
      const auto point = static_cast<Index>(child / 4);
      const int component = child % 4;
      if (!set.Contains(point)) {
        child = -1;
      } else {
        child = static_cast<int>(set.PositionsOf(PointSet::Of({point}, set.total()))[0]) * 4 + component;
      }
    }
  }
  kernel.object = std::move(assemble);
  return kernel;
}

// What a node's own functions throw is an error.
template <typename F>
auto OrItsFailure(F run) -> decltype(run()) {
  try {
    return run();
  } catch (const NodeFailure& failure) {
    return failure.status;
  }
}

// Resolves a request: the sources of its outputs.
Status ReachOutputs(const Graph& graph, const Request& request, InstanceTable* table,
                    std::vector<Source>* wanted) {
  for (const PlugRef& plug : request.varying) {
    KPSA_RETURN_IF_ERROR(graph.CheckPlug(plug));
    if (graph.def(plug.node).attributes[static_cast<std::size_t>(plug.attribute)].output) {
      return Status::Invalid("{} is an output and cannot vary by itself", graph.PlugName(plug));
    }
    PlugRef whole = plug;
    whole.component = -1;
    for (const PlugRef& p : {plug, whole}) {
      if (const Connection* c = graph.FindConnection(p)) {
        return Status::Invalid("{} is driven by {} and cannot vary by itself", graph.PlugName(plug),
                               graph.PlugName(c->source));
      }
    }
    table->AddVarying(plug);
  }
  for (const RequestedOutput& output : request.outputs) KPSA_RETURN_IF_ERROR(graph.CheckPlug(output.plug));
  for (const RequestedOutput& output : request.outputs) {
    const AttributeDef& a =
        graph.def(output.plug.node).attributes[static_cast<std::size_t>(output.plug.attribute)];
    if (IsPointType(a.type) && !a.array && output.plug.element >= 0) {
      return Status::Invalid("{}: ask for the points and name a point set instead",
                             graph.PlugName(output.plug));
    }
    wanted->push_back(table->Reach(output.plug));
    if (SlotSize(wanted->back().type) == 0)
      return Status::Invalid("{} is structural and has no value at run time", graph.PlugName(output.plug));
  }
  return table->status();
}

}  // namespace

struct Compiler::Impl {
  // A digest is as good as a random number already
  struct DigestHash {
    std::size_t operator()(const Digest& digest) const { return static_cast<std::size_t>(digest.lo); }
  };
  template <typename T>
  using ByDigest = std::unordered_map<Digest, T, DigestHash>;
  using RestOutputs = ByDigest<std::shared_ptr<const StaticEvaluator::Outputs>>;
  ByDigest<BoundKernel> kernels;
  RestOutputs rest;
  // Which deformers touch which points, as they were asked since the last compilation began, and before that
  ByDigest<std::optional<bool>> touches, earlier_touches;
  CompileStats stats;

  // A kernel that was bound before, or one that is bound now and kept.
  Result<BoundKernel> KernelOf(InstanceTable& table, StaticEvaluator& statics, const RestDigests& digests,
                               Index instance, const InstanceSets& sets, Digest* key) {
    Hasher hasher;
    hasher.Add(digests[instance]);
    for (const auto& elements : sets.outputs) {
      for (const PointSet& set : elements) hasher.Add(set.digest());
    }
    for (const PointSet& set : sets.inputs) hasher.Add(set.digest());
    *key = hasher.Finish();
    if (const auto it = kernels.find(*key); it != kernels.end()) {
      ++stats.kernels_reused;
      return it->second;
    }
    Result<BoundKernel> kernel = Bind(table, statics, instance, sets);
    if (kernel.ok()) kernels.emplace(*key, *kernel), ++stats.kernels_bound;
    return kernel;
  }
  // Rest values and kernels of earlier compilations, which what is evaluated here adds to.
  void Share(InstanceTable& table, StaticEvaluator& statics, const RestDigests& digests) {
    for (Index i = 0; i < table.instances().size(); ++i) {
      if (const auto it = rest.find(digests[i]); it != rest.end()) statics.SetRest(i, it->second);
    }
    statics.BindBy([&](Index instance, const InstanceSets& sets) {
      if (table.instances()[instance].kind != Instance::Kind::kNode ||
          !table.group(table.instances()[instance]).bind)
        return Result<BoundKernel>(BoundKernel());
      Digest key;
      return KernelOf(table, statics, digests, instance, sets, &key);
    });
    statics.RememberTouches([&](Index instance, const PointSet& points) -> std::optional<bool>& {
      Hasher hasher;
      hasher.Add(digests[instance]);
      hasher.Add(points.digest());
      const Digest key = hasher.Finish();
      std::optional<bool>& known = touches[key];
      if (const auto it = earlier_touches.find(key); !known.has_value() && it != earlier_touches.end())
        known = it->second;
      return known;
    });
  }
  RestOutputs RestOf(const InstanceTable& table, StaticEvaluator& statics, const RestDigests& digests) {
    RestOutputs kept;
    for (Index i = 0; i < table.instances().size(); ++i) {
      if (auto outputs = statics.FindRest(i)) kept.emplace(digests[i], std::move(outputs));
    }
    return kept;
  }
};

Compiler::Compiler() : impl_(std::make_unique<Impl>()) {}
Compiler::~Compiler() = default;
const CompileStats& Compiler::stats() const { return impl_->stats; }

Result<std::shared_ptr<const Plan>> Compiler::Compile(const Graph& graph, const Request& request) {
  return OrItsFailure([&] { return CompileOrThrow(graph, request); });
}

Result<std::vector<Compiler::Stepped>> Compiler::Steps(const Graph& graph, const Request& request) {
  Result<Survey> survey = SurveyOf(graph, request, {});
  if (!survey.ok()) return survey.status();
  return std::move(survey->steps);
}

Result<Compiler::Survey> Compiler::SurveyOf(const Graph& graph, const Request& request,
                                            const std::vector<PlugRef>& points) {
  return OrItsFailure([&] { return SurveyOrThrow(graph, request, points); });
}

Result<Value> Compiler::Rest(const Graph& graph, const PlugRef& plug) {
  return OrItsFailure([&] { return RestOrThrow(graph, plug); });
}

Result<Compiler::SplitPoints> Compiler::Split(const Graph& graph, const PlugRef& points) {
  return OrItsFailure([&] { return SplitOrThrow(graph, points); });
}

Result<std::shared_ptr<const Plan>> Compiler::CompileOrThrow(const Graph& graph, const Request& request) {
  impl_->stats = CompileStats();
  InstanceTable table(graph, request);
  std::vector<Source> wanted;
  KPSA_RETURN_IF_ERROR(ReachOutputs(graph, request, &table, &wanted));
  bool binds = false;
  for (const Instance& instance : table.instances()) {
    binds = binds || (instance.kind == Instance::Kind::kNode && table.group(instance).bind);
  }
  StaticEvaluator statics(table);
  const std::vector<Index> order = binds ? table.Order() : std::vector<Index>();
  std::unique_ptr<RestDigests> digests;
  if (binds) {
    digests = std::make_unique<RestDigests>(table, order);
    impl_->earlier_touches = std::exchange(impl_->touches, {});
    impl_->Share(table, statics, *digests);
  }
  Result<PlanDraft> draft = DraftPlan(table, statics, wanted, request);
  if (!statics.status().ok()) return statics.status();  // rather than what follows from it
  if (!draft.ok()) return draft.status();

  // Bind kernels, or take them from an earlier compilation
  std::vector<BoundKernel> kernels(draft->steps.size());
  Impl::ByDigest<BoundKernel> used;
  for (Index s = 0; s < draft->steps.size(); ++s) {
    const DraftStep& step = draft->steps[s];
    const Instance* instance = step.instance == kNoIndex ? nullptr : &table.instances()[step.instance];
    if (instance == nullptr || instance->kind != Instance::Kind::kNode) {
      kernels[s] = BuiltinKernel(table, step);
      continue;
    }
    if (!table.group(*instance).bind) continue;
    Digest key;
    Result<BoundKernel> kernel = impl_->KernelOf(table, statics, *digests, step.instance, step.sets, &key);
    if (!statics.status().ok())
      return statics.status();  // an input's failure rather than what follows from it
    if (!kernel.ok()) return kernel.status();
    kernels[s] = *kernel;
    used.emplace(key, kernels[s]);
  }
  // What this compilation needed is kept, the rest forgotten
  impl_->kernels = std::move(used);
  impl_->stats.rest_evaluated = statics.evaluated();
  if (binds) impl_->rest = impl_->RestOf(table, statics, *digests);
  const StepOrder step_order = OrderSteps(table, *draft);
  return PlanBuilder(table, *draft, step_order, request, std::move(kernels)).Build();
}

namespace {

Result<Compiler::SplitPoints> SplitIn(InstanceTable& table, StaticEvaluator& statics, const PlugRef& points,
                                      const Source& source) {
  using SplitPoints = Compiler::SplitPoints;
  const Graph& graph = table.graph();
  const NodeDef& def = graph.def(points.node);
  if (!def.last_step || source.kind != Source::Kind::kInstance) return SplitPoints();
  const Instance& instance = table.instances()[source.instance];
  if (instance.kind != Instance::Kind::kNode || instance.node != points.node) return SplitPoints();
  const ComputeGroup& group = table.group(instance);
  SplitPoints split;
  for (const Input& input : instance.inputs) {
    const int attribute = group.inputs[static_cast<std::size_t>(input.position)];
    const AttributeDef& a = def.attributes[static_cast<std::size_t>(attribute)];
    const PlugRef plug{points.node, attribute, input.element, -1};
    if (a.type == Type::kMatrix) continue;
    if (IsPointType(a.type) && split.in.attribute < 0) {  // the first are those that it deforms
      const Connection* driven = graph.FindConnection(plug);
      if (driven == nullptr) return SplitPoints();
      split.in = driven->source;
      continue;
    }
    if (input.source.kind != Source::Kind::kValue) return SplitPoints();
  }
  if (split.in.attribute < 0) return SplitPoints();
  const StructuralView view(table, instance.node, instance.geometry, &instance, &statics);
  Result<std::shared_ptr<const LastStep>> step = def.last_step(view);
  if (!step.ok()) return step.status();
  split.step = std::move(*step);
  return split;
}

}  // namespace

Result<Compiler::Survey> Compiler::SurveyOrThrow(const Graph& graph, const Request& request,
                                                 const std::vector<PlugRef>& points) {
  InstanceTable table(graph, request);
  std::vector<Source> wanted;
  KPSA_RETURN_IF_ERROR(ReachOutputs(graph, request, &table, &wanted));
  std::vector<Source> sources(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (points[i].attribute < 0) continue;
    KPSA_RETURN_IF_ERROR(graph.CheckPlug(points[i]));
    sources[i] = table.Reach(points[i]);
  }
  if (!table.status().ok()) return table.status();
  StaticEvaluator statics(table);
  const RestDigests digests(table, table.Order());
  impl_->Share(table, statics, digests);
  const Result<PlanDraft> draft = DraftPlan(table, statics, wanted, request);
  if (!statics.status().ok()) return statics.status();
  if (!draft.ok()) return draft.status();
  Survey survey;
  survey.split.resize(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (points[i].attribute < 0) continue;
    Result<SplitPoints> split = SplitIn(table, statics, points[i], sources[i]);
    if (!split.ok()) return split.status();
    survey.split[i] = std::move(*split);
  }
  impl_->rest.merge(impl_->RestOf(table, statics, digests));
  std::map<Index, Stepped> nodes;
  for (const DraftStep& step : draft->steps) {
    if (step.instance == kNoIndex && step.inputs[0].kind == DraftInput::Kind::kStep)
      continue;  // another's points
    const NodeId node = step.instance != kNoIndex ? table.instances()[step.instance].node
                                                  : table.varying()[step.inputs[0].varying].node;
    Stepped& stepped = nodes[node.index];
    stepped.node = node;
    for (const auto& elements : step.sets.outputs) {
      for (const PointSet& set : elements) stepped.points = stepped.points || set.total() > 0;
    }
  }
  for (const auto& [index, stepped] : nodes) survey.steps.push_back(stepped);
  return survey;
}

Result<Compiler::SplitPoints> Compiler::SplitOrThrow(const Graph& graph, const PlugRef& points) {
  KPSA_RETURN_IF_ERROR(graph.CheckPlug(points));
  if (!graph.def(points.node).last_step) return SplitPoints();
  Request request;
  InstanceTable table(graph, request);
  const Source source = table.Reach(points);
  if (!table.status().ok()) return table.status();
  StaticEvaluator statics(table);
  const RestDigests digests(table, table.Order());
  impl_->Share(table, statics, digests);
  Result<SplitPoints> split = SplitIn(table, statics, points, source);
  impl_->rest.merge(impl_->RestOf(table, statics, digests));
  return split;
}

Result<Value> Compiler::RestOrThrow(const Graph& graph, const PlugRef& plug) {
  KPSA_RETURN_IF_ERROR(graph.CheckPlug(plug));
  Request request;
  InstanceTable table(graph, request);
  const Source source = table.Reach(plug);
  if (!table.status().ok()) return table.status();
  StaticEvaluator statics(table);
  const std::vector<Index> order = table.Order();
  const RestDigests digests(table, order);
  impl_->Share(table, statics, digests);
  const Value* value = statics.Get(source, true);
  if (value == nullptr || !statics.status().ok()) return statics.status();
  const Value rest = *value;
  impl_->rest.merge(impl_->RestOf(table, statics, digests));
  return rest;
}

}  // namespace kpsa::engine
