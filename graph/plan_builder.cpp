#include "graph/plan_builder.h"

#include <algorithm>
#include <cstring>

#include "base/check.h"
#include "graph/authored.h"
#include "graph/builtin_steps.h"
#include "graph/static_eval.h"

namespace kpsa::engine {
namespace {

constexpr Index kLeastBatch = 4;             // steps that are worth a batch
constexpr std::size_t kFetchedBytes = 1024;  // of a kernel, ahead of its step

}  // namespace

std::uint32_t PlanBuilder::AddSlot(std::size_t size) {
  auto& values = plan_->initial_values_;
  const std::size_t at = values.size();
  values.resize(at + (size + 7) / 8 * 8);
  KPSA_CHECK_LE(values.size(), std::size_t{0xffffffff});
  return static_cast<std::uint32_t>(at);
}

std::uint32_t PlanBuilder::AddText(const std::string& text) {
  const auto [it, added] = texts_.emplace(text, static_cast<std::uint32_t>(plan_->text_.size()));
  if (added) plan_->text_.append(text.c_str(), text.size() + 1);
  return it->second;
}

std::uint32_t PlanBuilder::AddBuffer(std::uint32_t slot, const PointSet& points, Type type, bool workspace,
                                     std::uint32_t reuse) {
  Plan::Buffer buffer;
  buffer.slot = slot;
  buffer.count = points.size();
  buffer.components = PointComponents(type);
  buffer.workspace = workspace;
  if (reuse != kNoIndex) {
    buffer.offset = plan_->buffers_[reuse].offset;
  } else {
    std::size_t& floats = workspace ? plan_->workspace_floats_ : plan_->buffer_floats_;
    buffer.offset = floats;
    floats += PaddedCount(buffer.count) * static_cast<std::size_t>(buffer.components);
  }
  plan_->buffers_.push_back(buffer);
  return static_cast<std::uint32_t>(plan_->buffers_.size() - 1);
}

std::uint32_t PlanBuilder::ConstantSlot(const Value& value, Type type, const PointSet& points) {
  if (!IsPointType(type)) {
    // Equal bytes share a slot, whatever they mean
    std::byte bytes[sizeof(Matrix4)];
    value.WriteSlot(type, bytes);
    const auto [it, added] =
        small_constants_.emplace(std::string(reinterpret_cast<const char*>(bytes), SlotSize(type)), 0);
    if (added) {
      it->second = AddSlot(SlotSize(type));
      std::memcpy(plan_->initial_values_.data() + it->second, bytes, SlotSize(type));
    }
    return it->second;
  }
  const auto [it, added] = point_constants_.emplace(std::make_pair(&value, points.digest()), 0);
  if (!added) return it->second;
  KPSA_CHECK(value.points() != nullptr);
  std::shared_ptr<const PointBuffer> held = value.get<PointBufferPtr>();
  if (!points.is_all())
    held = std::make_shared<PointBuffer>(GatherPoints(held->view(), held->components(), points));
  plan_->owned_.push_back(held);
  const std::uint32_t slot = AddSlot(sizeof(PointsView));
  it->second = slot;
  const ConstPointsView view = held->view();
  std::memcpy(plan_->initial_values_.data() + slot, &view, sizeof(view));
  return slot;
}

void PlanBuilder::NumberSteps() {
  number_.assign(draft_.steps.size(), kNoIndex);
  plan_->segments_.resize(draft_.segments.size());
  for (Index g = 0; g < draft_.segments.size(); ++g) {
    Plan::Segment& segment = plan_->segments_[g];
    segment.parent = draft_.segments[g].parent;
    segment.begin = static_cast<Index>(placed_.size());
    Index level = kNoIndex;
    for (const StepOrder::Unit& unit : order_.segments[g]) {
      if (unit.level != level) segment.levels.push_back(static_cast<Index>(placed_.size()));
      level = unit.level;
      for (Index s : unit.steps) {
        number_[s] = static_cast<Index>(placed_.size());
        placed_.push_back(s);
      }
    }
    segment.end = static_cast<Index>(placed_.size());
    segment.levels.push_back(segment.end);
  }
  for (Index g = 1; g < draft_.segments.size(); ++g) {
    if (const Index owner = draft_.segments[g].owner; owner != kNoIndex)
      plan_->segments_[g].owner = number_[owner];
    plan_->segments_[g].users = draft_.segments[g].users;
    plan_->segments_[g].needs = draft_.segments[g].needs;
  }
  plan_->steps_.resize(placed_.size());
  plan_->infos_.resize(placed_.size());
  for (const auto& units : order_.segments) {
    for (const StepOrder::Unit& unit : units) {
      for (std::size_t i = 0; i < unit.steps.size(); ++i) {
        Plan::Step& step = plan_->steps_[number_[unit.steps[i]]];
        step.unit_size = i == 0 ? static_cast<std::uint16_t>(unit.steps.size()) : std::uint16_t{1};
        step.unit_offset = static_cast<std::uint16_t>(i);
      }
    }
  }
}

void PlanBuilder::AddVarying() {
  const Graph& graph = table_.graph();
  for (const PlugRef& plug : table_.varying()) {
    Plan::Varying varying;
    varying.plug = plug;
    varying.name = graph.PlugName(plug);
    varying.type = graph.PlugType(plug);
    const AttributeDef& a = graph.def(plug.node).attributes[static_cast<std::size_t>(plug.attribute)];
    varying.min = a.min, varying.max = a.max;
    if (varying.type == Type::kBool) varying.min = 0, varying.max = 1;
    if (varying.type == Type::kEnum)
      varying.min = 0, varying.max = static_cast<double>(a.enum_names.size()) - 1;
    const Value* held = table_.HeldValue(plug.node, plug.attribute, plug.element);
    varying.slot = AddSlot(SlotSize(varying.type));
    if (IsPointType(varying.type)) {
      varying.points = static_cast<Index>(held->points()->count());
      const std::uint32_t buffer =
          AddBuffer(varying.slot, PointSet::All(varying.points), varying.type, false, kNoIndex);
      plan_->owned_.push_back(held->get<PointBufferPtr>());
      plan_->buffers_[buffer].initial = held->points();
    } else {
      held->WriteSlot(varying.type, plan_->initial_values_.data() + varying.slot);
    }
    plan_->varying_.push_back(std::move(varying));
  }
}

void PlanBuilder::PlaceOutputs() {
  slots_.resize(draft_.steps.size());
  buffer_of_step_.assign(draft_.steps.size(), kNoIndex);
  for (Index s : placed_) {  // in plan order: an overwritten step comes before the one that overwrites it
    const DraftStep& draft = draft_.steps[s];
    Plan::Step& step = plan_->steps_[number_[s]];
    const Instance* instance = draft.instance == kNoIndex ? nullptr : &table_.instances()[draft.instance];
    const auto type_of = [&](std::size_t p) {
      return instance == nullptr ? draft.gather_type : table_.OutputType(*instance, static_cast<int>(p));
    };
    slots_[s].outputs.resize(draft.sets.outputs.size());
    bool has_points = false;
    for (std::size_t p = 0; p < draft.sets.outputs.size(); ++p)
      has_points = has_points || IsPointType(type_of(p));
    step.value = static_cast<std::uint32_t>(plan_->initial_values_.size());
    for (bool small :
         {true, false}) {  // small outputs first, side by side: they are compared after a compute
      for (std::size_t p = 0; p < draft.sets.outputs.size(); ++p) {
        const Type type = type_of(p);
        if (IsSmallType(type) != small) continue;
        for (const PointSet& set : draft.sets.outputs[p]) {
          const std::uint32_t slot = AddSlot(SlotSize(type));
          slots_[s].outputs[p].push_back(slot);
          if (small) continue;
          const Index overwritten = p == 0 ? order_.overwrites[s] : kNoIndex;
          const std::uint32_t buffer =
              AddBuffer(slot, set, type, draft.segment != 0,
                        overwritten == kNoIndex ? kNoIndex : buffer_of_step_[overwritten]);
          if (buffer_of_step_[s] == kNoIndex) buffer_of_step_[s] = buffer;
          if (draft.segment != 0) plan_->segments_[draft.segment].uses_workspace = true;
        }
      }
      if (small)
        step.value_size =
            has_points ? 0 : static_cast<std::uint32_t>(plan_->initial_values_.size()) - step.value;
    }
    const BoundKernel& kernel = kernels_[s];
    step.kernel = kernel.object.get();
    step.kernel_bytes = static_cast<std::uint32_t>(std::min(kernel.object_bytes, kFetchedBytes));
    if (kernel.object != nullptr) plan_->owned_.push_back(kernel.object);
    step.scratch = static_cast<std::uint32_t>(plan_->workspace_floats_);
    plan_->workspace_floats_ += PaddedCount(kernel.scratch_floats);
    KPSA_CHECK_LE(plan_->workspace_floats_, std::size_t{0xffffffff});
    step.state = static_cast<std::uint32_t>(plan_->state_bytes_);
    plan_->state_bytes_ += (kernel.state_bytes + 63) / 64 * 64;
  }
}

std::uint32_t PlanBuilder::SlotOf(const DraftInput& input) {
  const std::uint32_t component = input.component < 0 ? 0 : static_cast<std::uint32_t>(8 * input.component);
  switch (input.kind) {
    case DraftInput::Kind::kConstant:
      return ConstantSlot(*input.value, input.type, input.points);
    case DraftInput::Kind::kVarying:
      return plan_->varying_[input.varying].slot + component;
    case DraftInput::Kind::kStep:
      return slots_[input.step]
                 .outputs[static_cast<std::size_t>(input.output)][static_cast<std::size_t>(input.element)] +
             component;
  }
  return 0;
}

Index PlanBuilder::ProducerOf(const DraftInput& input) const {
  if (input.kind == DraftInput::Kind::kStep) return number_[input.step];
  if (input.kind == DraftInput::Kind::kVarying)
    return static_cast<Index>(plan_->steps_.size()) + input.varying;
  return kNoIndex;
}

Index PlanBuilder::ShapeOf(const Instance& instance, const ComputeGroup& group) {
  const auto [it, added] = shape_of_.emplace(&group, static_cast<Index>(plan_->shapes_.size()));
  if (added) plan_->shapes_.push_back(StepShape::Of(table_.graph().def(instance.node), group));
  return it->second;
}

void PlanBuilder::FillSteps() {
  std::vector<std::uint32_t> table;
  for (Index n = 0; n < placed_.size(); ++n) {
    const DraftStep& draft = draft_.steps[placed_[n]];
    Plan::Step& step = plan_->steps_[n];
    Plan::StepInfo& info = plan_->infos_[n];
    const Instance* instance = draft.instance == kNoIndex ? nullptr : &table_.instances()[draft.instance];
    const ComputeGroup* group =
        instance != nullptr && instance->kind == Instance::Kind::kNode ? &table_.group(*instance) : nullptr;

    if (group != nullptr) info.shape = ShapeOf(*instance, *group);

    // Inputs: a slot each; arrays as tables behind them
    table.assign(group != nullptr ? group->inputs.size() : draft.inputs.size(), 0);
    if (group == nullptr) {
      for (std::size_t i = 0; i < draft.inputs.size(); ++i) table[i] = SlotOf(draft.inputs[i]);
    } else {
      std::size_t at = 0;
      for (std::size_t p = 0; p < group->inputs.size(); ++p) {
        const AttributeDef& a = table_.input_def(*instance, static_cast<int>(p));
        const auto count = static_cast<std::size_t>(instance->array_sizes[p]);
        if (!a.array || (a.per_geometry && group->per_geometry)) {
          table[p] = SlotOf(draft.inputs[at]);
        } else {
          table[p] = static_cast<std::uint32_t>(table.size());
          table.push_back(static_cast<std::uint32_t>(count));
          for (std::size_t e = 0; e < count; ++e) table.push_back(SlotOf(draft.inputs[at + e]));
        }
        at += count;
      }
    }
    step.in = static_cast<std::uint32_t>(plan_->tables_.size());
    plan_->tables_.insert(plan_->tables_.end(), table.begin(), table.end());

    const auto& outputs = slots_[placed_[n]].outputs;
    table.assign(outputs.size(), 0);
    for (std::size_t p = 0; p < outputs.size(); ++p) {
      const bool array =
          group != nullptr && !group->per_geometry && table_.output_def(*instance, static_cast<int>(p)).array;
      if (!array) {
        table[p] = outputs[p][0];
      } else {
        table[p] = static_cast<std::uint32_t>(table.size());
        table.push_back(static_cast<std::uint32_t>(outputs[p].size()));
        table.insert(table.end(), outputs[p].begin(), outputs[p].end());
      }
    }
    step.out = static_cast<std::uint32_t>(plan_->tables_.size());
    plan_->tables_.insert(plan_->tables_.end(), table.begin(), table.end());

    // What it runs
    if (group != nullptr) {
      const ComputeFn bound = kernels_[placed_[n]].compute;
      step.compute = bound != nullptr ? bound : group->compute;
    } else if (instance == nullptr) {
      step.compute = draft.gather_type == Type::kWeights ? ComputeGatherWeights : ComputeGatherPoints;
    } else if (instance->kind == Instance::Kind::kAssemble) {
      step.compute = IsPointType(instance->type) ? ComputeAssemblePoints : ComputeAssembleSmall;
    } else {
      const bool from_double = draft.inputs[0].type == Type::kDouble;
      step.compute = instance->type == Type::kDouble ? ComputeIntToDouble
                     : instance->type == Type::kBool ? (from_double ? ComputeDoubleToBool : ComputeIntToBool)
                                                     : ComputeDoubleToInt;
    }

    // Dependencies; lazy inputs belong to the branch
    step.deps = static_cast<std::uint32_t>(plan_->deps_.size());
    for (const DraftInput& input : draft.inputs) {
      const Index producer = ProducerOf(input);
      if (producer != kNoIndex && !input.lazy) plan_->deps_.push_back(producer);
    }
    std::sort(plan_->deps_.begin() + step.deps, plan_->deps_.end());
    plan_->deps_.erase(std::unique(plan_->deps_.begin() + step.deps, plan_->deps_.end()), plan_->deps_.end());
    step.deps_count = static_cast<std::uint32_t>(plan_->deps_.size()) - step.deps;
    if (group != nullptr && (group->decide != nullptr || group->compute_block != nullptr)) {
      step.branch = static_cast<std::uint32_t>(plan_->branches_.size());
      Plan::Branch branch;
      branch.decide = group->decide;
      branch.compute_block = group->compute_block;
      branch.bit_of_lazy = draft.lazy_bits;
      branch.segment_of_lazy = draft.lazy_segments;
      for (const DraftInput& input : draft.inputs) {
        if (input.lazy) branch.lazy_deps.push_back(ProducerOf(input));
      }
      plan_->branches_.push_back(std::move(branch));
    }

    // What a person sees
    info.node = instance == nullptr ? NodeId() : instance->node;
    info.segment = draft.segment;
    if (instance == nullptr) {  // a gather is told by what it copies
      const DraftInput& from = draft.inputs[0];
      if (from.kind == DraftInput::Kind::kStep) {
        info = plan_->infos_[number_[from.step]];
      } else {
        info.node = table_.varying()[from.varying].node;
        info.name = AddText(table_.graph().name(info.node));
        info.type = AddText(table_.graph().def(info.node).name);
      }
      info.segment = draft.segment;
      info.label = AddText("gather");
    } else {
      const NodeDef& def = table_.graph().def(instance->node);
      if (def.stateful && plan_->stateful_node_.empty())
        plan_->stateful_node_ = table_.graph().name(instance->node);
      if (def.prototype && plan_->prototype_node_.empty())
        plan_->prototype_node_ = table_.graph().name(instance->node);
      info.name = AddText(table_.graph().name(instance->node));
      info.type = AddText(def.name);
      info.label = AddText(instance->kind == Instance::Kind::kAssemble  ? "assemble"
                           : instance->kind == Instance::Kind::kConvert ? "convert"
                                                                        : "");
    }
    info.points = info.points_total = 0;
    for (const auto& elements : draft.sets.outputs) {
      for (const PointSet& set : elements) {
        info.points += set.size();
        info.points_total += set.total();
      }
    }
    const BoundKernel& kernel = kernels_[placed_[n]];
    const auto touched = static_cast<float>(std::min(info.points, kernel.touched_points));
    info.cost_ns = group == nullptr ? 10.0f + 0.5f * static_cast<float>(info.points)
                                    : group->cost_ns + group->cost_ns_per_point * touched;
    if (kernel.cost_ns > 0) info.cost_ns = kernel.cost_ns;
  }
}

const ComputeGroup* PlanBuilder::BatchGroup(Index number) const {
  const DraftStep& draft = draft_.steps[placed_[number]];
  if (draft.instance == kNoIndex || table_.instances()[draft.instance].kind != Instance::Kind::kNode)
    return nullptr;
  const ComputeGroup& group = table_.group(table_.instances()[draft.instance]);
  return group.compute_batch != nullptr && plan_->steps_[number].unit_size == 1 ? &group : nullptr;
}

void PlanBuilder::MakeBatches() {
  for (const Plan::Segment& segment : plan_->segments_) {
    for (std::size_t level = 0; level + 1 < segment.levels.size(); ++level) {
      const Index end = segment.levels[level + 1];
      for (Index first = segment.levels[level], last; first < end; first = last) {
        const ComputeGroup* group = BatchGroup(first);
        for (last = first + 1; last < end && group != nullptr && BatchGroup(last) == group;) ++last;
        if (last - first < kLeastBatch) continue;
        std::vector<const void*> kernels;
        for (Index s = first; s < last; ++s) {
          plan_->steps_[s].batch = static_cast<std::uint32_t>(plan_->batches_.size());
          kernels.push_back(plan_->steps_[s].kernel);
        }
        Plan::Batch batch;
        batch.compute = group->compute_batch;
        if (group->bind_batch) {
          const NodeId node = plan_->infos_[first].node;
          plan_->owned_.push_back(CallAuthored(table_, node, [&] { return group->bind_batch(kernels); }));
          batch.kernel = plan_->owned_.back().get();
        }
        batch.first = first;
        batch.count = last - first;
        batch.stride = plan_->steps_[first + 1].in - plan_->steps_[first].in;
        batch.scratch = static_cast<std::uint32_t>(plan_->workspace_floats_);
        plan_->workspace_floats_ +=
            PaddedCount(batch.count * plan_->steps_[first].value_size / sizeof(float));
        KPSA_CHECK_LE(plan_->workspace_floats_, std::size_t{0xffffffff});
        plan_->batches_.push_back(batch);
      }
    }
  }
}

void PlanBuilder::FillRequestOutputs() {
  for (std::size_t i = 0; i < request_.outputs.size(); ++i) {
    const DraftInput& input = draft_.outputs[i];
    Plan::Output output;
    output.name = table_.graph().PlugName(request_.outputs[i].plug);
    output.type = input.type;
    output.slot = SlotOf(input);
    output.producer = ProducerOf(input);
    output.points = input.points;
    plan_->outputs_.push_back(std::move(output));
  }
}

void PlanBuilder::Connect() {
  // Consumers: readers, and for lazy inputs the step that owns them
  const std::size_t producers = plan_->steps_.size() + plan_->varying_.size();
  std::vector<Index> counts(producers + 1, 0);
  const auto each = [&](auto&& visit) {
    for (Index s = 0; s < plan_->steps_.size(); ++s) {
      const Plan::Step& step = plan_->steps_[s];
      for (Index d = 0; d < step.deps_count; ++d) visit(plan_->deps_[step.deps + d], s);
      if (step.branch == kNoIndex) continue;
      for (Index producer : plan_->branches_[step.branch].lazy_deps) {
        if (producer != kNoIndex) visit(producer, s);
      }
    }
  };
  each([&](Index producer, Index) { ++counts[producer + 1]; });
  for (std::size_t i = 1; i < counts.size(); ++i) counts[i] += counts[i - 1];
  plan_->consumer_offsets_ = counts;
  plan_->consumers_.resize(counts.back());
  each([&](Index producer, Index consumer) { plan_->consumers_[counts[producer]++] = consumer; });
}

void PlanBuilder::CacheClosures() {
  // Ranges for as many varying plugs as cost no more than a few visits a step; the others are walked when set
  std::size_t budget = 64 * (plan_->steps_.size() + 64);
  std::vector<Index> mark(plan_->steps_.size(), kNoIndex), found;
  for (Index v = 0; v < plan_->varying_.size() && budget > 0; ++v) {
    found.clear();
    const auto visit = [&](Index producer) {
      for (Index consumer : plan_->consumers(producer)) {
        if (mark[consumer] == v) continue;
        mark[consumer] = v;
        found.push_back(consumer);
      }
    };
    visit(static_cast<Index>(plan_->steps_.size()) + v);
    for (std::size_t at = 0; at < found.size(); ++at) visit(found[at]);
    std::sort(found.begin(), found.end());
    std::vector<std::pair<Index, Index>> ranges;
    for (Index s : found) {
      if (!ranges.empty() && ranges.back().second == s) {
        ++ranges.back().second;
      } else {
        ranges.emplace_back(s, s + 1);
      }
    }
    budget -= std::min(budget, found.size() + 1);
    ranges.shrink_to_fit();
    plan_->closures_.push_back(std::move(ranges));
  }
}

void PlanBuilder::CacheNeeds() {
  // Of as many outputs as cost no more than a few visits a step
  std::size_t budget = 16 * (plan_->steps_.size() + 64);
  std::vector<Index> stack;
  stack.reserve(plan_->steps_.size());
  for (Index output = 0; output < plan_->outputs_.size() && budget > 0; ++output) {
    std::vector<std::uint64_t> bits(plan_->steps_.size() / 64 + 1, 0);
    budget -=
        std::min(budget, 1 + bits.size() + plan_->AddNeeds(plan_->outputs_[output].producer, bits, &stack));
    plan_->needs_.push_back(std::move(bits));
  }
}

void PlanBuilder::Explain() {
  std::vector<char> kept(table_.graph().node_capacity(), 0), folded = kept;
  std::vector<PlanDraft::Passed> passed(kept.size(), PlanDraft::Passed::kNo);
  for (const Plan::StepInfo& info : plan_->infos_) {
    if (info.node.index != kNoIndex) kept[info.node.index] = 1;
  }
  for (std::size_t i = 0; i < table_.instances().size(); ++i) {
    if (!draft_.varying[i]) folded[table_.instances()[i].node.index] = 1;
    if (draft_.passed[i] != PlanDraft::Passed::kNo)
      passed[table_.instances()[i].node.index] = draft_.passed[i];
  }
  for (const PlugRef& plug : table_.varying()) kept[plug.node.index] = 1;
  for (NodeId node : table_.graph().Nodes()) {
    if (kept[node.index]) continue;
    const PlanDraft::Passed pass = passed[node.index];
    const char* reason = pass == PlanDraft::Passed::kEquals        ? "hands on what drives it, unchanged"
                         : pass == PlanDraft::Passed::kTouchesNone ? "moves none of the points of the request"
                         : folded[node.index] ? "constant: depends on nothing that varies"
                                              : "not needed by the request";
    plan_->excluded_.push_back({table_.graph().name(node), reason});
  }
}

std::shared_ptr<const Plan> PlanBuilder::Build() {
  plan_->text_.push_back('\0');
  NumberSteps();
  AddVarying();
  PlaceOutputs();
  FillSteps();
  MakeBatches();
  FillRequestOutputs();
  Connect();
  CacheClosures();
  CacheNeeds();
  Explain();
  plan_->tables_.shrink_to_fit();
  plan_->deps_.shrink_to_fit();
  plan_->initial_values_.shrink_to_fit();
  plan_->owned_.shrink_to_fit();
  return plan_;
}

}  // namespace kpsa::engine
