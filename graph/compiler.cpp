#include "graph/compiler.h"

#include <map>

#include "graph/authored.h"
#include "graph/builtin_steps.h"
#include "graph/plan_builder.h"
#include "graph/static_eval.h"

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

}  // namespace

struct Compiler::Impl {
  std::map<Digest, BoundKernel> kernels;
  std::map<Digest, std::shared_ptr<const StaticEvaluator::Outputs>> rest;
  CompileStats stats;

  void UseRest(StaticEvaluator& statics, const RestDigests& digests, std::size_t count) {
    for (Index i = 0; i < count; ++i) {
      if (const auto it = rest.find(digests[i]); it != rest.end()) statics.SetRest(i, it->second);
    }
  }
  // Keeps what this compilation needed, forgets the rest.
  void KeepRest(StaticEvaluator& statics, const RestDigests& digests, std::size_t count) {
    std::map<Digest, std::shared_ptr<const StaticEvaluator::Outputs>> kept;
    for (Index i = 0; i < count; ++i) {
      if (auto outputs = statics.FindRest(i)) kept.emplace(digests[i], std::move(outputs));
    }
    rest = std::move(kept);
  }
};

Compiler::Compiler() : impl_(std::make_unique<Impl>()) {}
Compiler::~Compiler() = default;
const CompileStats& Compiler::stats() const { return impl_->stats; }

Result<std::shared_ptr<const Plan>> Compiler::Compile(const Graph& graph, const Request& request) {
  try {
    return CompileOrThrow(graph, request);
  } catch (const NodeFailure& failure) {
    return failure.status;
  }
}

Result<Value> Compiler::Rest(const Graph& graph, const PlugRef& plug) {
  try {
    return RestOrThrow(graph, plug);
  } catch (const NodeFailure& failure) {
    return failure.status;
  }
}

Result<std::shared_ptr<const Plan>> Compiler::CompileOrThrow(const Graph& graph, const Request& request) {
  impl_->stats = CompileStats();
  InstanceTable table(graph, request);
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
    table.AddVarying(plug);
  }
  std::vector<Source> wanted;
  for (const RequestedOutput& output : request.outputs) KPSA_RETURN_IF_ERROR(graph.CheckPlug(output.plug));
  for (const RequestedOutput& output : request.outputs) {
    const AttributeDef& a =
        graph.def(output.plug.node).attributes[static_cast<std::size_t>(output.plug.attribute)];
    if (IsPointType(a.type) && !a.array && output.plug.element >= 0) {
      return Status::Invalid("{}: ask for the points and name a point set instead",
                             graph.PlugName(output.plug));
    }
    wanted.push_back(table.Reach(output.plug));
    if (SlotSize(wanted.back().type) == 0)
      return Status::Invalid("{} is structural and has no value at run time", graph.PlugName(output.plug));
  }

  if (!table.status().ok()) return table.status();
  bool binds = false;
  for (const Instance& instance : table.instances()) {
    binds = binds || (instance.kind == Instance::Kind::kNode && table.group(instance).bind);
  }
  StaticEvaluator statics(table);
  const std::vector<Index> order = binds ? table.Order() : std::vector<Index>();
  std::unique_ptr<RestDigests> digests;
  if (binds) {
    digests = std::make_unique<RestDigests>(table, order);
    impl_->UseRest(statics, *digests, table.instances().size());
  }
  Result<PlanDraft> draft = DraftPlan(table, statics, wanted, request);
  if (!statics.status().ok()) return statics.status();  // rather than what follows from it
  if (!draft.ok()) return draft.status();

  // Bind kernels, or take them from an earlier compilation
  std::vector<BoundKernel> kernels(draft->steps.size());
  std::map<Digest, BoundKernel> used;
  for (Index s = 0; s < draft->steps.size(); ++s) {
    const DraftStep& step = draft->steps[s];
    const Instance* instance = step.instance == kNoIndex ? nullptr : &table.instances()[step.instance];
    if (instance == nullptr || instance->kind != Instance::Kind::kNode) {
      kernels[s] = BuiltinKernel(table, step);
      continue;
    }
    if (!table.group(*instance).bind) continue;
    Hasher hasher;
    hasher.Add((*digests)[step.instance]);
    for (const auto& elements : step.sets.outputs) {
      for (const PointSet& set : elements) hasher.Add(set.digest());
    }
    for (const PointSet& set : step.sets.inputs) hasher.Add(set.digest());
    const Digest key = hasher.Finish();
    if (const auto it = impl_->kernels.find(key); it != impl_->kernels.end()) {
      kernels[s] = it->second;
      ++impl_->stats.kernels_reused;
    } else {
      Result<BoundKernel> kernel = Bind(table, statics, step.instance, step.sets);
      if (!statics.status().ok())
        return statics.status();  // an input's failure rather than what follows from it
      if (!kernel.ok()) return kernel.status();
      kernels[s] = *kernel;
      ++impl_->stats.kernels_bound;
    }
    used.emplace(key, kernels[s]);
  }
  impl_->kernels = std::move(used);
  impl_->stats.rest_evaluated = statics.evaluated();
  if (binds) impl_->KeepRest(statics, *digests, table.instances().size());
  const StepOrder step_order = OrderSteps(table, *draft);
  return PlanBuilder(table, *draft, step_order, request, std::move(kernels)).Build();
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
  for (Index i = 0; i < table.instances().size(); ++i) {
    if (const auto it = impl_->rest.find(digests[i]); it != impl_->rest.end()) statics.SetRest(i, it->second);
  }
  const Value* value = statics.Get(source, true);
  if (value == nullptr || !statics.status().ok()) return statics.status();
  return *value;
}

}  // namespace kpsa::engine
